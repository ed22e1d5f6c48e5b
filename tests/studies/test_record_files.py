"""The names of the files state the stored runs, and each run belongs to the narrowest file."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from baldwinlab.studies.record_files import (
    RecordFile,
    StoredRuns,
    StudyError,
    assign_runs,
    find_record_file,
    list_record_files,
    list_stored_runs,
    record_name,
    split_runs,
)


def touch(folder: Path, *ranges: tuple[int, int]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for first, last in ranges:
        (folder / record_name(first, last)).touch()


def find_holder(files: list[RecordFile], run: int) -> RecordFile:
    """Return the narrowest file of a run, by a search over all files."""
    holders = [file for file in files if file.first <= run <= file.last]
    return min(holders, key=lambda file: (file.last - file.first, file.first))


@pytest.mark.parametrize("seed", range(20))
def test_each_run_belongs_to_the_narrowest_of_any_files(tmp_path: Path, seed: int) -> None:
    numbers = random.Random(seed)
    ranges = []
    for _ in range(numbers.randint(1, 12)):
        first = numbers.randint(0, 60)
        ranges.append((first, first + numbers.choice([0, 0, 1, 5, 20])))
    folder = tmp_path / "runs" / "evo/A"
    touch(folder, *ranges)
    (folder / "0005.checkpoint").touch()
    (folder / ".0007.nc.partial").touch()
    files = list_record_files(folder)
    assert sorted((file.first, file.last) for file in files) == sorted(set(ranges))
    stored = sorted({run for first, last in ranges for run in range(first, last + 1)})
    assert list_stored_runs(folder) == stored
    assigned = {run: entry.file for entry in assign_runs(files) for run in entry.runs}
    assert assigned == {run: find_holder(files, run) for run in stored}
    for run in range(90):
        file = find_record_file(tmp_path, "evo/A", run)
        expected = assigned.get(run, RecordFile(folder / record_name(run), run, run))
        assert file == expected


def test_a_condition_without_a_folder_has_no_files(tmp_path: Path) -> None:
    assert list_record_files(tmp_path / "runs" / "evo/A") == []


@pytest.mark.parametrize(
    "name",
    [
        "0005-0005.nc",
        "0009-0003.nc",
        "0000-1000.nc",
        "000-009.nc",
        "00000-0009.nc",
        "0000-0009-0012.nc",
        "0000_0009.nc",
        "2147483640-2147483648.nc",
        "-0009.nc",
        "1.nc",
        "00001.nc",
        "99999999999.nc",
        "2147483648.nc",
        "mine.nc",
    ],
)
def test_an_invalid_name_of_a_file_is_one_clear_error(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.touch()
    with pytest.raises(StudyError, match=f"{re.escape(str(path))} has no name of a record"):
        list_record_files(tmp_path)


def test_runs_are_split_where_they_are_not_consecutive_or_change_their_file() -> None:
    def entry(first: int, last: int) -> StoredRuns:
        file = RecordFile(Path(record_name(first, last)), first, last)
        return StoredRuns(file, file.runs)

    holders = [entry(3, 5), entry(6, 9)]
    groups = split_runs([8, 1, 2, 3, 4, 6, 7, 12, 11, 20], holders)
    assert list(groups) == [[1, 2], [3, 4], [6, 7, 8], [11, 12], [20]]
    assert list(split_runs([], holders)) == []
