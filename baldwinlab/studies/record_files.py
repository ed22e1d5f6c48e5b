"""Files of records: names, numbers of runs, and the runs that each file holds.

A file holds one run, runs/CONDITION/RUN.nc, or a batch of consecutive runs,
runs/CONDITION/FIRST-LAST.nc. The numbers have at least four digits. The list of the files is the
only index of the runs.

Two files can hold the same run: two processes have written it, or an extension has continued it.
The narrower file is valid then. A run is therefore only written again into a file that is not wider
than the file that holds it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.files import is_local
from baldwinlab.core.numbers import SEED_LIMIT
from baldwinlab.simulation.memory import MAX_RUNS_PER_FILE

_NAME_PATTERN: Final = re.compile(r"([0-9]{1,10})(?:-([0-9]{1,10}))?\.nc")


class StudyError(BaldwinLabError):
    """Invalid study: not a study, a different study, or not accessible."""


class RecordFile(NamedTuple):
    """A file of records."""

    path: Path
    first: int
    last: int

    @property
    def runs(self) -> range:
        """Numbers of the runs in the file."""
        return range(self.first, self.last + 1)

    @property
    def is_batch(self) -> bool:
        """Whether the file has the form of a batch. The file of one run has another form."""
        return self.last > self.first

    def __str__(self) -> str:
        return f"runs {self.first} to {self.last}" if self.is_batch else f"run {self.first}"


class StoredRuns(NamedTuple):
    """A file of records, and its runs that no narrower file holds."""

    file: RecordFile
    runs: Sequence[int]


def record_name(first: int, last: int | None = None) -> str:
    """Return the name of the file of a run, or of the runs from `first` to `last`."""
    if last is None or last == first:
        return f"{first:04d}.nc"
    return f"{first:04d}-{last:04d}.nc"


def condition_folder(directory: Path, condition: str) -> Path:
    """Return the folder with the records of a condition."""
    return directory / "runs" / condition


def record_path(directory: Path, condition: str, run: int) -> Path:
    """Return the file of a run that is stored alone."""
    return condition_folder(directory, condition) / record_name(run)


def list_record_files(folder: Path) -> list[RecordFile]:
    """Return the files of records in the folder of a condition.

    Raises StudyError for a file that ends in .nc without the name of a record. Otherwise the file
    would be ignored, or confused with another run.
    """
    try:
        return [_parse_file(folder / name, is_file) for name, is_file in _list_names(folder)]
    except (FileNotFoundError, NotADirectoryError):
        return []


def _list_names(folder: Path) -> list[tuple[str, bool]]:
    """Return the names that end in .nc, each with whether it is a file."""
    if is_local(folder):
        # Much faster than a path and a system call for each file.
        with os.scandir(folder) as entries:
            names = [(entry.name, entry.is_file()) for entry in entries]
    else:
        names = [(path.name, True) for path in folder.iterdir()]
    # The names of temporary files start with a dot.
    return [entry for entry in names if entry[0].endswith(".nc") and not entry[0].startswith(".")]


def _parse_file(path: Path, is_file: bool) -> RecordFile:
    match = _NAME_PATTERN.fullmatch(path.name)
    remedy = "remove it, or change its extension"
    if match is None or max(map(int, filter(None, match.groups()))) >= SEED_LIMIT:
        raise StudyError(f"{path} has no name of a record: {remedy}")
    first = int(match[1])
    last = first if match[2] is None else int(match[2])
    is_valid_range = match[2] is None or first < last < first + MAX_RUNS_PER_FILE
    if not is_valid_range:
        raise StudyError(
            f"{path} has no name of a record: a file holds 2 to {MAX_RUNS_PER_FILE} consecutive "
            f"runs; {remedy}"
        )
    if path.name != record_name(first, last):
        raise StudyError(
            f"{path} has no name of a record; {RecordFile(path, first, last)} is stored as "
            f"{record_name(first, last)}: {remedy}"
        )
    if not is_file:
        raise StudyError(f"{path} has the name of a record but is not a file: remove it")
    return RecordFile(path, first, last)


def assign_runs(files: Iterable[RecordFile]) -> list[StoredRuns]:
    """Return the files with the runs that they hold, in the order of their first run.

    A run that is in several files belongs to the narrowest. A file can hold no run.
    """
    ordered = sorted(files, key=lambda file: file.first)
    is_disjoint = all(previous.last < file.first for previous, file in pairwise(ordered))
    if is_disjoint:
        return [StoredRuns(file, file.runs) for file in ordered]
    assigned: set[int] = set()
    stored = []
    for file in sorted(ordered, key=lambda file: (len(file.runs), file.first)):
        runs = [run for run in file.runs if run not in assigned]
        assigned.update(runs)
        stored.append(StoredRuns(file, runs))
    return sorted(stored, key=lambda entry: entry.file.first)


def list_stored_runs(folder: Path) -> list[int]:
    """Return the sorted numbers of the stored runs of a condition."""
    return sorted({run for file in list_record_files(folder) for run in file.runs})


def find_record_file(directory: Path, condition: str, run: int) -> RecordFile:
    """Return the file that holds a run, or the file that would hold it alone."""
    path = record_path(directory, condition, run)
    single = RecordFile(path, run, run)
    if path.exists():
        return single
    batches = [
        file
        for file in list_record_files(path.parent)
        if file.first <= run <= file.last and file.is_batch
    ]
    return min(batches, key=lambda file: (len(file.runs), file.first), default=single)


def split_runs(runs: Sequence[int], holders: Sequence[StoredRuns]) -> Iterator[list[int]]:
    """Yield the sorted runs in groups of consecutive runs that one file, or no file, holds."""
    holder_of_run = {run: entry.file for entry in holders for run in entry.runs}
    group: list[int] = []
    for run in sorted(runs):
        is_next = group and run == group[-1] + 1
        if group and not (is_next and holder_of_run.get(run) == holder_of_run.get(group[-1])):
            yield group
            group = []
        group.append(run)
    if group:
        yield group
