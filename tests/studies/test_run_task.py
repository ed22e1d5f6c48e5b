"""A task that is repeated continues the work of its first attempt."""

from __future__ import annotations

from pathlib import Path

import pytest
import xarray as xr

from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.studies import run_task
from baldwinlab.studies.checkpoints import Interval, checkpoint_path
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors.tasks import StoppedError
from baldwinlab.studies.run_task import RunTask
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study, read_records, shorten_preset

SEED = 5
EXPERIMENT = shorten_preset("evo/A").replace(evolution={"generations": 6}, lifetime={"steps": 50})


class Attempt:
    """An attempt of a task, which records its progress and the simulated generations."""

    def __init__(self, study: StudyStore, runs: tuple[int, ...], stop_after: int = 1000) -> None:
        self.reports: list[int] = []
        self.simulated: list[tuple[int, int]] = []
        self._stop_after = stop_after
        self.task = RunTask(
            EXPERIMENT,
            runs,
            is_new=True,
            checkpoint_interval=Interval(generations=1),
            callback=self._add_generation,
        )
        self.task.run(SEED, study.directory, CPU, self._report)

    def _add_generation(self, data: xr.Dataset) -> None:
        self.simulated.append((int(data.attrs["run"]), data.sizes["generation"] - 1))

    def _report(self, agent_steps: int) -> None:
        self.reports.append(agent_steps)
        if len(self.reports) == self._stop_after:
            raise StoppedError


@pytest.fixture
def study(tmp_path: Path) -> StudyStore:
    return create_study(tmp_path / "study", [EXPERIMENT], SEED)


@pytest.fixture
def expected(tmp_path: Path) -> dict[str, bytes]:
    return read_records(make_small_study(tmp_path / "threads", [EXPERIMENT], 4, SEED).directory)


def test_runs_that_another_process_has_stored_are_not_simulated_again(
    study: StudyStore, expected: dict[str, bytes]
) -> None:
    Attempt(study, (1, 3))
    attempt = Attempt(study, (0, 1, 2, 3))
    assert {run for run, _ in attempt.simulated} == {0, 2}
    assert sum(attempt.reports) == attempt.task.agent_steps
    assert read_records(study.directory) == expected


def test_a_repeated_task_continues_from_the_checkpoints_of_a_lost_worker(
    study: StudyStore, expected: dict[str, bytes]
) -> None:
    with pytest.raises(StoppedError):
        Attempt(study, (0, 1, 2, 3), stop_after=4)
    checkpoints = [checkpoint_path(study.directory, "evo/A", run) for run in range(4)]
    assert all(path.exists() for path in checkpoints)
    attempt = Attempt(study, (0, 1, 2, 3))
    # The last stored generation is simulated again.
    assert attempt.simulated == [(run, generation) for generation in (3, 4, 5) for run in range(4)]
    assert sum(attempt.reports) == attempt.task.agent_steps
    assert read_records(study.directory) == expected
    assert not any(path.exists() for path in checkpoints)


def test_a_short_task_lists_no_files(
    study: StudyStore, expected: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    task = RunTask(EXPERIMENT, (0, 1, 2, 3), is_new=True)
    assert task.agent_steps < run_task.MIN_STEPS_OF_SEARCH
    monkeypatch.delattr("baldwinlab.studies.record_files._list_names")
    task.run(SEED, study.directory, CPU, lambda agent_steps: None)
    monkeypatch.undo()
    assert read_records(study.directory) == expected
