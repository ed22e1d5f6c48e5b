"""Names of the files of records, and the runs that each file holds.

A file holds one run, runs/CONDITION/RUN.nc, or a batch of consecutive runs,
runs/CONDITION/FIRST-LAST.nc. The run numbers have at least four digits. The names of the files are
the only list of the stored runs.

Two files hold the same run if two processes have written this run, or if an extension has continued
it. The file with fewer runs, the narrower file, is then valid for this run. Therefore a run is
written again only into a file that has at most as many runs as the old file.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.files import list_names
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
        """Whether the file holds several runs. A file of one run has another format."""
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

    Raises StudyError for a file that ends in .nc but does not have the name of a record, because
    the file would be ignored, or confused with another run.
    """
    try:
        names = list_names(folder)
    except (FileNotFoundError, NotADirectoryError):
        return []
    # The names of temporary files start with a dot.
    return [
        _parse_file(folder / name, is_file)
        for name, is_file in names.items()
        if name.endswith(".nc") and not name.startswith(".")
    ]


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
    """Return the files, sorted by first run, each with the runs for which the file is valid.

    If several files hold a run, the narrowest file is valid. A file can be valid for no run.
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
    """Return the file that holds a run; if the run is not stored, the file for this run alone."""
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
    """Yield groups of consecutive runs. All runs of a group are in the same file, or in none."""
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
