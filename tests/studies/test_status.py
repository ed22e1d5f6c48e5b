"""The status states runs, speed, processes and failures. Verdicts are read if they fit the runs."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.studies import progress
from baldwinlab.studies.creation import create_study, extend_study
from baldwinlab.studies.progress import ProcessProgress, ProgressFile, read_progress
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.status import CLAIMS_FILE, read_claims, read_status, write_claims
from baldwinlab.studies.store import StudyStore
from tests.small_studies import ignore_message, ignore_progress, make_small_study, shorten_preset
from tests.studies.completion import fail_without_space
from tests.studies.test_batched_studies import CONDITION, SEED, make_experiment, make_study
from tests.studies.test_run_task import EXPERIMENTS


def test_a_new_study_has_no_runs_and_no_process(tmp_path: Path) -> None:
    status = read_status(create_study(tmp_path, [make_experiment()], SEED))
    assert (status.done, status.missing) == ({CONDITION: 0}, {CONDITION: 0})
    assert not status.running
    assert status.failures == ()
    study = create_study(tmp_path, [make_experiment()], SEED)
    for content in ("", "[]", "{}", '{"host": 1}'):
        (tmp_path / ".running-a-1.json").write_text(content)
        assert read_status(study).running == ()


@pytest.mark.parametrize("runs", [3, 40])
def test_a_finished_study_has_no_missing_run(tmp_path: Path, runs: int) -> None:
    status = read_status(make_study(tmp_path, runs=runs))
    assert (status.done, status.missing) == ({CONDITION: runs}, {CONDITION: 0})
    assert status.steps_per_second > 0
    assert status.seconds_left == 0
    assert not list(tmp_path.glob(".running-*")), "the process has ended"


@pytest.mark.parametrize("runs", [4, 30])
def test_incomplete_and_stopped_runs_are_distinguished(tmp_path: Path, runs: int) -> None:
    experiment = EXPERIMENTS["stopped runs"]
    study = make_small_study(tmp_path, [experiment], runs, SEED, workers=1)
    assert read_status(study).done == {CONDITION: runs}
    extended = extend_study(study, experiment.evolution.generations + 4)
    missing = find_missing_runs(extended, runs, ignore_message)
    status = read_status(extended)
    assert status.missing == {CONDITION: len(missing[CONDITION])}
    assert status.seconds_left is not None


def test_the_status_shows_the_workers_that_a_cluster_has_now(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = create_study(tmp_path, [make_experiment()], SEED)
    start = ProcessProgress.begin(1, "dask", "cpu", runs=4, agent_steps=100)
    n_workers = iter([7, 3])

    def count_workers() -> int:
        try:
            return next(n_workers)
        except StopIteration:
            raise OSError("the scheduler does not answer") from None

    monkeypatch.setattr(progress, "WRITE_INTERVAL", 0)
    with closing(ProgressFile(tmp_path, start, count_workers)) as file:
        shown_workers = []
        for _ in range(4):
            shown_workers.append(read_status(study).workers)
            file.add(1)
    assert shown_workers == [1, 7, 3, 3]


def test_missing_runs_are_those_of_the_largest_condition_or_of_the_last_session(
    tmp_path: Path,
) -> None:
    experiments = [shorten_preset("evo/A"), shorten_preset("evo+self-taught/A")]
    study = make_small_study(tmp_path, experiments, runs=2)
    run_study(study, {"evo/A": [2]}, 1, ignore_progress, ignore_message)
    assert read_status(study).missing == {"evo/A": 0, "evo+self-taught/A": 1}
    study.path("evo/A", 2).unlink()
    assert read_status(study).missing == {"evo/A": 1, "evo+self-taught/A": 1}


def test_damaged_files_are_failures(tmp_path: Path) -> None:
    study = make_study(tmp_path, runs=40)
    path = study.path(CONDITION, 0)
    path.write_bytes(b"no netCDF")
    status = read_status(study)
    assert status.missing == {CONDITION: 40}
    assert status.failures == (f"{path} cannot be read: TypeError",)
    find_missing_runs(study, 40, ignore_message)
    (failure,) = read_status(study).failures
    assert failure.startswith(f"{path}.damaged")


def test_the_error_of_a_session_is_a_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = make_study(tmp_path, runs=2)
    with monkeypatch.context() as full_disk:
        full_disk.setattr(os, "fsync", fail_without_space)
        with pytest.raises(OSError, match="no space is left"):
            run_study(study, {CONDITION: [2, 3]}, 1, ignore_progress, ignore_message)
    (failure,) = read_status(study).failures
    assert "the last session ended with an error" in failure
    assert "no space is left" in failure
    assert read_status(study).missing == {CONDITION: 2}


RUNNING_STUDY = """
import sys
from pathlib import Path
from baldwinlab.studies import progress
from tests.studies.test_batched_studies import make_study
progress.WRITE_INTERVAL = 0.01
make_study(Path(sys.argv[1]), runs=100_000)
"""


def test_a_running_study_has_a_process_and_a_killed_one_a_failure(tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-c", RUNNING_STUDY, str(tmp_path)])
    try:
        while not any(entry.agent_steps_done for _, entry in read_progress(tmp_path)):
            assert process.poll() is None
            time.sleep(0.01)
        status = read_status(StudyStore(tmp_path))
    finally:
        process.kill()
        process.wait()
    (running,) = status.running
    assert running.pid == process.pid
    assert status.workers == 1
    assert sum(status.done.values()) + sum(status.missing.values()) == 100_000
    assert status.steps_per_second > 0
    assert status.seconds_left is not None
    assert status.seconds_left > 0
    assert json.loads(json.dumps(status.to_dict()))["is_running"]
    study = StudyStore(tmp_path)
    after = read_status(study)
    assert not after.running
    assert after.failures == (f"process {process.pid} on {socket.gethostname()} was killed",)
    assert sum(after.missing.values()) > 0
    study.sweep()
    assert read_status(study).failures == ()


def test_a_process_on_another_machine_counts_as_ended_after_a_long_silence() -> None:
    local = ProcessProgress.begin(2, "dask", "cpu", runs=10, agent_steps=100)
    assert local.is_running
    remote = local._replace(host="node-7")
    assert remote.is_running
    silence = progress.MAX_SILENCE_IN_SECONDS + 1
    assert not remote._replace(updated=time.time() - silence).is_running


def test_progress_is_not_written_into_a_removed_study(tmp_path: Path) -> None:
    file = ProgressFile(
        tmp_path / "study", ProcessProgress.begin(1, "threads", "cpu", runs=1, agent_steps=1)
    )
    file.close()
    assert not (tmp_path / "study").exists()


VERDICTS: list[dict[str, Any]] = [
    {"id": "C1", "verdict": "undecided", "effect": 1.5},
    {"id": "C2", "verdict": "holds", "effect": None},
]


@pytest.fixture
def study(tmp_path: Path) -> StudyStore:
    return make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=2)


def test_claims_are_read_as_they_were_written(study: StudyStore) -> None:
    assert read_claims(study) == []
    write_claims(study, VERDICTS)
    assert read_claims(study) == VERDICTS


def test_a_manually_changed_file_is_refused(study: StudyStore) -> None:
    write_claims(study, VERDICTS)
    path = study.directory / CLAIMS_FILE
    stored = json.loads(path.read_text())
    for changed in (
        stored | {"claims": [VERDICTS[0] | {"verdict": "holds"}, VERDICTS[1]]},
        stored | {"claims": [VERDICTS[0] | {"effect": 2.5}, VERDICTS[1]]},
        stored | {"claims": [*VERDICTS, VERDICTS[0]]},
        stored | {"records": "0" * 64},
        *(5, {}, {"claims": 5}, {"claims": [5]}, None, "claims", VERDICTS),
    ):
        path.write_text(json.dumps(changed))
        message = r"claims\.json was not written by a report; `baldwinlab report .*` makes it"
        with pytest.raises(StudyError, match=message):
            read_claims(study)


def test_claims_about_different_runs_are_refused(study: StudyStore, tmp_path: Path) -> None:
    write_claims(study, VERDICTS)
    grown = make_small_study(study.directory, [shorten_preset("evo/A")], runs=3)
    second = make_small_study(tmp_path / "other", [shorten_preset("evo/A")], runs=3, seed=6)
    write_claims(second, VERDICTS)
    for path in (grown.directory / CLAIMS_FILE, second.directory / CLAIMS_FILE):
        (grown.directory / CLAIMS_FILE).write_bytes(path.read_bytes())
        message = "was decided by other runs than those that are stored now"
        with pytest.raises(StudyError, match=message):
            read_claims(grown)


def test_huge_claims_are_refused_before_they_are_read(study: StudyStore) -> None:
    (study.directory / CLAIMS_FILE).touch()
    os.truncate(study.directory / CLAIMS_FILE, 20 * 10**9)
    with pytest.raises(
        StudyError,
        match="cannot be read: it has 20,000,000,000 bytes, and a JSON file of results may",
    ):
        read_claims(study)
