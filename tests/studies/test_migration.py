"""A migration merges single files into batches, and changes no record."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

import pytest
import xarray as xr

from baldwinlab.core.netcdf import decode_variables, from_bytes, to_bytes
from baldwinlab.core.record_batches import select_record
from baldwinlab.simulation import memory
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies import migration
from baldwinlab.studies.claims_file import read_claims, write_claims
from baldwinlab.studies.extension import extend_study
from baldwinlab.studies.migration import RawRecord, migrate_study, stack_records
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import encode_record
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.store import StudyStore
from tests.small_studies import ignore_message, ignore_progress, make_small_study, read_records
from tests.studies.test_record_writer import EXPERIMENTS, require_equal

RUNS = 42
SEED = 3
CONDITION = "evo/A"


@pytest.fixture(scope="module")
def single_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of version 0.1: each run has a file."""
    directory = tmp_path_factory.mktemp("single") / "study"
    with pytest.MonkeyPatch.context() as earlier:
        earlier.setattr(memory, "MAX_RUNS_PER_FILE", 1)
        make_small_study(directory, [EXPERIMENTS["stopped runs"]], RUNS, SEED, workers=1)
    return directory


@pytest.fixture
def study(single_files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StudyStore:
    monkeypatch.setattr(memory, "MAX_RUNS_PER_FILE", 20)
    return StudyStore(shutil.copytree(single_files, tmp_path / "study"))


def list_names(study: StudyStore) -> list[str]:
    return [file.path.name for file in study.files(CONDITION)]


def require_same_records(study: StudyStore, single_files: Path) -> None:
    expected = StudyStore(single_files)
    assert study.runs(CONDITION) == expected.runs(CONDITION)
    for run in expected.runs(CONDITION):
        require_equal(study.record(CONDITION, run), expected.record(CONDITION, run))
    xr.testing.assert_identical(open_runs(study.directory), open_runs(expected.directory))
    assert find_missing_runs(study, RUNS, pytest.fail) == {CONDITION: []}


def test_a_migration_changes_no_record(study: StudyStore, single_files: Path) -> None:
    assert len(list_names(study)) == RUNS
    result = migrate_study(study, pytest.fail)
    # The last two files are too few for a batch.
    last_names = ["0040.nc", "0041.nc"]
    assert list_names(study) == ["0000-0019.nc", "0020-0039.nc", *last_names]
    assert result == (40, 2, 4)
    require_same_records(study, single_files)
    assert migrate_study(study, pytest.fail) == (0, 0, 4)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_records_of_any_kind_can_be_merged(name: str) -> None:
    histories = simulate_histories(EXPERIMENTS[name], SEED, range(5))
    contents = [encode_record(history.record()) for history in histories]
    records = [RawRecord(*decode_variables(content)) for content in contents]
    assert len({migration._batch_key(record) for record in records}) == 1
    expected = [from_bytes(content) for content in contents]
    longest = max(expected, key=lambda record: record.sizes["generation"])
    batch = from_bytes(to_bytes(stack_records(records, longest)))
    for index, record in enumerate(expected):
        require_equal(select_record(batch, index), record)


def test_a_dry_run_reports_the_result_and_writes_nothing(study: StudyStore) -> None:
    before = read_records(study.directory)
    assert migrate_study(study, pytest.fail, is_dry_run=True) == (40, 2, 4)
    assert read_records(study.directory) == before


@pytest.mark.parametrize("seed", range(2))
def test_an_interrupted_migration_is_continued(
    study: StudyStore, single_files: Path, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    n_removals = random.Random(seed).randrange(40)

    class InterruptionError(Exception):
        pass

    unlink = Path.unlink

    def unlink_until(path: Path, missing_ok: bool = False) -> None:
        nonlocal n_removals
        if path.suffix == ".nc":
            n_removals -= 1
            if n_removals < 0:
                raise InterruptionError
        unlink(path, missing_ok)

    with monkeypatch.context() as interruption:
        interruption.setattr(Path, "unlink", unlink_until)
        with pytest.raises(InterruptionError):
            migrate_study(study, pytest.fail)
    require_same_records(study, single_files)
    migrate_study(study, pytest.fail)
    assert len(list_names(study)) == 4
    require_same_records(study, single_files)


def test_a_damaged_file_is_not_merged(study: StudyStore, single_files: Path) -> None:
    path = study.path(CONDITION, 25)
    path.write_bytes(path.read_bytes()[:-10])
    messages: list[str] = []
    migrate_study(study, messages.append)
    (message,) = messages
    assert message.startswith(f"{path} is damaged")
    assert "it is not merged" in message
    assert list_names(study)[:4] == ["0000-0019.nc", "0020-0024.nc", "0025.nc", "0026-0039.nc"]
    missing = find_missing_runs(study, RUNS, ignore_message)
    assert missing == {CONDITION: [25]}
    run_study(study, missing, 1, ignore_progress, ignore_message)
    require_same_records(study, single_files)


def test_a_migrated_study_is_extended_like_a_study_of_single_files(
    study: StudyStore, single_files: Path, tmp_path: Path
) -> None:
    generations = study.experiments[CONDITION].evolution.generations + 2
    migrate_study(study, pytest.fail)
    expected = StudyStore(shutil.copytree(single_files, tmp_path / "expected"))
    for directory in (study, expected):
        extended = extend_study(directory, generations)
        missing = find_missing_runs(extended, RUNS, pytest.fail)
        run_study(extended, missing, 1, ignore_progress, ignore_message)
    require_same_records(StudyStore(study.directory), expected.directory)


def test_runs_of_other_versions_are_in_other_batches(study: StudyStore, single_files: Path) -> None:
    records = [migration._read_raw(study, CONDITION, file) for file in study.files(CONDITION)[:6]]
    records[3].attributes["baldwinlab"] = "0.0.1"
    keys = [migration._batch_key(record) for record in records]
    assert [key == keys[0] for key in keys] == [True, True, True, False, True, True]


def test_the_claims_of_a_study_stay_valid(study: StudyStore) -> None:
    claims = [{"id": "C1", "verdict": "reproduced"}]
    write_claims(study, claims)
    migrate_study(study, pytest.fail)
    assert read_claims(study) == claims


def test_large_runs_stay_in_single_files(
    study: StudyStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "MAX_STEPS_PER_FILE", 1000)
    before = read_records(study.directory)
    assert migrate_study(study, pytest.fail) == (0, 0, RUNS)
    assert read_records(study.directory) == before
