"""A file of records states its runs in its name, and is read only if it belongs to them."""

from __future__ import annotations

import hashlib
import random
import re
import shutil
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.io import netcdf_file

from baldwinlab.core.netcdf import from_bytes, to_bytes
from baldwinlab.core.records import as_run
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies import records
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.record_files import (
    RecordFile,
    StoredRuns,
    assign_runs,
    find_record_file,
    list_record_files,
    list_stored_runs,
    record_name,
    split_runs,
)
from baldwinlab.studies.records import DamagedRecordError, StudyError, encode_record
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_file import add_checksum
from tests.small_studies import (
    ignore_message,
    ignore_progress,
    make_small_study,
    read_records,
    shorten_preset,
)
from tests.studies.completion import complete_runs


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


def test_a_run_is_read_from_its_record_unchanged_also_with_scipy(tmp_path: Path) -> None:
    for stride in (1, 2, 100):
        thinned = shorten_preset().replace(record={"genome_every": stride})
        run = simulate(thinned, seed=2**31 - 1)
        xr.testing.assert_identical(as_run(from_bytes(encode_record(run))), run)
    path = tmp_path / "run.nc"
    run = simulate(shorten_preset(), seed=1)
    path.write_bytes(encode_record(run))
    with netcdf_file(path, mmap=False) as file:
        assert np.array_equal(file.variables["food_eaten"][:], run.food_eaten.values)
        assert getattr(file, "condition") == b"evo+self-taught/A"  # noqa: B009


def test_the_attributes_of_a_record_are_read_without_its_arrays(tmp_path: Path) -> None:
    study = make_small_study(tmp_path)
    assert study.attributes("evo/A", 1) == study.read("evo/A", 1).attrs
    study.path("evo/A", 1).write_bytes(study.path("evo/A", 1).read_bytes()[:-1])
    with pytest.raises(
        DamagedRecordError, match=r"0001\.nc is damaged: its checksum does not fit its content"
    ):
        study.attributes("evo/A", 1)
    with pytest.raises(StudyError, match=r"0009\.nc does not exist"):
        study.attributes("evo/A", 9)


OTHER_EXPERIMENT = "the experiment that it was made with is not that of evo/A in this study"
Replacement = Callable[[StudyStore], Path]


def swap_records(study: StudyStore) -> Path:
    first = study.path("evo/A", 1)
    second = study.path("evo+self-taught/A", 1)
    temporary = first.with_suffix(".temporary")
    first.rename(temporary)
    second.rename(first)
    temporary.rename(second)
    return first


def copy_of_run_0(study: StudyStore) -> Path:
    return Path(shutil.copy(study.path("evo/A", 0), study.path("evo/A", 1)))


def cut_record(study: StudyStore) -> Path:
    path = study.path("evo/A", 1)
    path.write_bytes(path.read_bytes()[:-100])
    return path


def rename_attribute(study: StudyStore) -> Path:
    path = study.path("evo/A", 1)
    record = simulate(shorten_preset("evo/A"), seed=5, run=1)
    path.write_bytes(encode_record(record).replace(b"condition", b"kondition"))
    return path


def write_different_record(seed: int = 5, generations: int = 4, rate: float = 0.05) -> Replacement:
    def put(study: StudyStore) -> Path:
        experiment = shorten_preset("evo/A").replace(
            evolution={"generations": generations, "mutation_rate": rate}
        )
        path = study.path("evo/A", 1)
        path.write_bytes(encode_record(simulate(experiment, seed=seed, run=1)))
        return path

    return put


@pytest.mark.parametrize(
    ("replace", "reason"),
    [
        (
            swap_records,
            r"it is run 1 of evo\+self-taught/A with seed 5, and run 1 of evo/A with seed 5 "
            "belongs there",
        ),
        (copy_of_run_0, "it is run 0 of evo/A with seed 5, and run 1 of evo/A"),
        (write_different_record(seed=6), "it is run 1 of evo/A with seed 6"),
        (write_different_record(rate=0.5), OTHER_EXPERIMENT),
        (cut_record, "its checksum does not fit its content"),
        (rename_attribute, "its checksum does not fit its content"),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_a_record_of_a_different_run_is_reported_moved_and_computed_again(
    tmp_path: Path, replace: Replacement, reason: str
) -> None:
    study = make_small_study(tmp_path)
    sound = read_records(tmp_path)
    path = replace(study)
    with pytest.raises(DamagedRecordError, match=f"{path} is damaged: {reason}"):
        open_runs(tmp_path)
    with pytest.raises(DamagedRecordError, match=reason):
        study.read("evo/A", 1)
    with pytest.raises(DamagedRecordError, match=reason):
        study.attributes("evo/A", 1)
    messages: list[str] = []
    complete_runs(study, 3, log=messages.append)
    assert any(f"{path} is damaged" in sentence for sentence in messages)
    assert path.with_name("0001.nc.damaged").exists()
    assert read_records(tmp_path) == sound


def test_a_record_that_is_not_a_file_is_reported(tmp_path: Path) -> None:
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=5)
    makers: list[Callable[[Path], None]]
    makers = [Path.mkdir, lambda path: path.symlink_to(tmp_path / "nowhere")]
    for number, make in enumerate(makers):
        path = study.path("evo/A", number)
        make(path)
        with pytest.raises(StudyError, match=f"{path} has the name of a record but is not a file"):
            find_missing_runs(study, 3, ignore_message)
        path.rmdir() if path.is_dir() else path.unlink()


def test_an_edited_experiment_is_reported_when_it_is_read(tmp_path: Path) -> None:
    """An experiment with a new checksum is reported when the records are read."""
    study = make_small_study(tmp_path)
    path = tmp_path / "runs/evo/A/experiment.toml"
    edited = path.read_text().replace("rate = 0.01", "rate = 0.02")
    path.write_text(edited)
    message = r"experiment\.toml cannot be read: it has been changed since the study was created"
    with pytest.raises(StudyError, match=message):
        StudyStore(study.directory)
    path.write_text(add_checksum(edited.partition("# SHA-256")[0]))
    with pytest.raises(DamagedRecordError, match=OTHER_EXPERIMENT):
        open_runs(study.directory)


@pytest.mark.parametrize("removal", ["study.toml deleted", "folder moved", "folder removed"])
def test_no_record_is_written_if_the_study_was_removed(tmp_path: Path, removal: str) -> None:
    directory = tmp_path / "study"
    study = create_study(directory, [shorten_preset("evo/A")], seed=5)
    if removal == "study.toml deleted":
        (directory / "study.toml").unlink()
    elif removal == "folder moved":
        directory.rename(tmp_path / "elsewhere")
    else:
        shutil.rmtree(directory)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(FileNotFoundError, match="the study has been removed or moved while it ran"):
        run_study(study, {"evo/A": [0, 1]}, 1, ignore_progress, ignore_message)
    assert [path for path in sorted(tmp_path.rglob("*")) if path.suffix != ".jsonl"] == before
    with pytest.raises(FileNotFoundError):
        study.write("evo/A", 0, simulate(shorten_preset("evo/A"), seed=5))


def test_a_study_that_is_moved_while_a_record_is_written_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    directory = tmp_path / "study"
    study = create_study(directory, [shorten_preset("evo/A")], seed=5)

    def move_study_and_write(path: Path, content: bytes) -> None:
        directory.rename(tmp_path / "elsewhere")
        path.write_bytes(content)

    monkeypatch.setattr(records, "write_atomically", move_study_and_write)
    with pytest.raises(FileNotFoundError, match="the study has been removed or moved while it ran"):
        study.write("evo/A", 0, simulate(shorten_preset("evo/A"), seed=5))


@pytest.mark.parametrize(
    "content_kind", ["other variables", "other sizes", "no coordinates", "text for numbers"]
)
def test_netcdf_that_is_not_a_run_is_reported_even_if_its_checksum_matches(
    tmp_path: Path, content_kind: str
) -> None:
    study = make_small_study(tmp_path / "study", runs=1)
    path = study.path("evo/A", 0)
    run = from_bytes(path.read_bytes())
    path.write_bytes(
        to_bytes(
            {
                "other variables": xr.Dataset({"rain": ("day", np.zeros(3))}, attrs=run.attrs),
                "other sizes": run.isel(generation=slice(2)),
                "no coordinates": run.drop_vars(list(run.coords)),
                "text for numbers": run.assign(energy=run.energy.astype("S1")),
            }[content_kind]
        )
    )
    with pytest.raises(
        DamagedRecordError, match=r"0000\.nc is damaged: it does not contain the variables of 3 gen"
    ):
        study.read("evo/A", 0)
    assert find_missing_runs(study, 1, ignore_message)["evo/A"] == [0]


def with_valid_checksum(raw: bytes) -> bytes:
    """Return a record with a checksum that matches its content."""
    match = re.search(rb"checksum.{8}([0-9a-f]{64})", raw, re.DOTALL)
    assert match is not None
    blank = raw[: match.start(1)] + b"0" * 64 + raw[match.end(1) :]
    return blank.replace(b"0" * 64, hashlib.sha256(blank).hexdigest().encode(), 1)


@pytest.mark.parametrize("field", ["kept_generation", "numrecs"])
def test_a_changed_number_in_the_header_is_reported_even_if_the_checksum_matches(
    tmp_path: Path, field: str
) -> None:
    study = make_small_study(tmp_path, [shorten_preset("evo/A")], runs=1)
    path = study.path("evo/A", 0)
    raw = path.read_bytes()
    offset = 4 if field == "numrecs" else raw.index(b"kept_generation") + 16
    number = struct.pack(">i", 2**31 - 1 if field == "numrecs" else 0)
    changed = raw[:offset] + number + raw[offset + 4 :]
    for content, reason in (
        (changed, "its checksum does not fit its content"),
        (
            with_valid_checksum(changed),
            "its header counts rows|the generations of its genomes are not those",
        ),
    ):
        path.write_bytes(content)
        with pytest.raises(DamagedRecordError, match=rf"0000\.nc is damaged: .*({reason})"):
            study.read("evo/A", 0)
    path.write_bytes(with_valid_checksum(raw))
    study.read("evo/A", 0)


def test_a_run_can_be_read_without_its_genomes(tmp_path: Path) -> None:
    study = make_small_study(
        tmp_path / "study", [shorten_preset().replace(record={"genome_every": 3})], runs=1
    )
    complete = study.read("evo+self-taught/A", 0)
    assert complete.genome.shape[0] == 3
    xr.testing.assert_identical(
        study.read("evo+self-taught/A", 0, genomes=False),
        complete.drop_vars(["genome", "module", "weight"]),
    )
