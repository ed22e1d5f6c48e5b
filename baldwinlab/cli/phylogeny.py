"""Who begot whom."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.export.files import write_phylogeny
from baldwinlab.cli.options import Directory, Force, Parts, PerhapsWhole, load_parts
from baldwinlab.core import console
from baldwinlab.studies.store import StudyStore


def phylogeny(
    directory: Directory,
    /,
    *,
    out: Annotated[Path, Parameter(help="the CSV file")],
    condition: Annotated[str | None, Parameter(help="all conditions unless given")] = None,
    run: Annotated[PerhapsWhole, Parameter(help="all runs unless given")] = None,
    part: Parts = None,
    force: Force = False,
) -> None:
    """Write who begot whom as CSV in the ALife data standard for phylogenies: of a run, a condition, or a whole study."""
    load_parts(part)
    count = write_phylogeny(StudyStore(directory), out, condition, run, force=force)
    console.info(f"{out}: {count:,} agents")
