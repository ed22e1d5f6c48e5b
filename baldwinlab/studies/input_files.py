"""Copies of data files in a study, so that it needs no file outside of its directory.

    DIR/inputs/evo-A-generation-99-1a2b3c4d.nc    genomes of founders
    DIR/inputs/worth-5e6f7a8b.txt                 data file of a part

The name ends in the first digits of the SHA-256, so two files with one name do not collide. The
experiments of the study name a copy by its path in the directory. The copy is found by its content
wherever the directory is.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path, PurePath
from typing import Any, Final

from baldwinlab.core.file_writing import write_exclusively
from baldwinlab.core.files import require_inside_study
from baldwinlab.experiment import BaseExperiment, validate
from baldwinlab.experiment.file import File, iterate_file_tables, remember_path
from baldwinlab.studies.record_files import StudyError

INPUT_FOLDER: Final = "inputs"
NAME_DIGITS: Final = 8


def name_copies(experiments: Sequence[BaseExperiment]) -> list[Any]:
    """Return experiments whose data files have the paths of their copies in a study."""
    renamed = []
    for experiment in experiments:
        tree = experiment.to_dict()
        tables = [table for _, table in iterate_file_tables(tree)]
        for table in tables:
            table["path"] = _name_copy(table)
        # The settings are valid already, and few experiments have data files.
        renamed.append(validate(tree, lenient=True) if tables else experiment)
    return renamed


def _name_copy(table: dict[str, Any]) -> str:
    """Return the path of the copy of a data file, relative to the directory of the study."""
    path = PurePath(table["path"])
    ending = f"-{table['sha256'][:NAME_DIGITS]}"
    return f"{INPUT_FOLDER}/{path.stem.removesuffix(ending)}{ending}{path.suffix}"


def write_copies(directory: Path, experiments: Iterable[BaseExperiment]) -> None:
    """Write the data files of experiments, which `name_copies` has named, into a study."""
    for experiment in experiments:
        for _, table in iterate_file_tables(experiment.to_dict()):
            path = directory / table["path"]
            content = File(path=table["path"], sha256=table["sha256"]).read()
            require_inside_study(path, directory)
            try:
                write_exclusively(path, content)
            except FileExistsError:
                if path.read_bytes() != content:
                    raise StudyError(
                        f"{path} is there already and holds something else; choose another --out"
                    ) from None
            remember_path(table["sha256"], path)
