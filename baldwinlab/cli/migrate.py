"""The command `migrate`: merge the files of single small runs into batches."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from baldwinlab.cli.options import FLAG, Directory, Json, Parts, load_parts
from baldwinlab.core import console
from baldwinlab.studies.migration import migrate_study
from baldwinlab.studies.store import StudyStore


def migrate(
    directory: Directory,
    /,
    *,
    dry_run: Annotated[
        bool, FLAG, Parameter(help="Print the number of files, and write nothing.")
    ] = False,
    part: Parts = None,
    json: Json = False,
) -> None:
    """Merge the files of single small runs of a study into files of many runs.

    The records do not change, and large runs stay in files of their own. Studies of version 0.1
    work without this command, but large ones open faster after it. An interrupted migration is
    continued by the same command.

    For example:

        baldwinlab migrate results/many --dry-run
    """
    load_parts(part)
    if json:
        console.reserve_stdout()
    study = StudyStore(directory)
    result = migrate_study(study, console.warn, is_dry_run=dry_run)
    if json:
        console.print_json(result._asdict())
        return
    verb = "would be merged" if dry_run else "merged"
    console.info(
        f"{directory}: {result.n_merged:,} files of single runs {verb} into "
        f"{result.n_batches:,} files; files of records: {result.n_files:,}"
    )
