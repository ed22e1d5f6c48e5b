"""A study has identical records after interruptions and for any number of workers."""

from __future__ import annotations

import shutil
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
import xarray as xr

from baldwinlab.analysis.statistics import fitness
from baldwinlab.core.files import parse_location
from baldwinlab.engine.threads import count_threads
from baldwinlab.models.miniworld.backends.choice import (
    CPU,
    GPU_TASKS,
    GPU_WORLDS,
    Backend,
)
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies import executors
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors import THREADS, Executor, describe_workers
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.run import find_missing_runs, plan_tasks
from baldwinlab.studies.run_task import RunTask
from tests.small_studies import (
    ignore_message,
    make_small_study,
    read_records,
    shorten_preset,
)


def test_a_study_is_identical_for_any_number_of_workers(tmp_path: Path) -> None:
    single = make_small_study(tmp_path / "one", workers=1)
    many = make_small_study(tmp_path / "many", workers=5)
    assert read_records(single.directory) == read_records(many.directory)
    for condition in single.experiments:
        for run in range(3):
            xr.testing.assert_identical(
                single.read(condition, run),
                simulate(single.experiments[condition], seed=5, run=run),
            )


@pytest.mark.parametrize(("tasks", "workers", "threads"), [(1, 4, 4), (2, 5, 2), (3, 2, 1)])
def test_tasks_use_idle_threads(tasks: int, workers: int, threads: int, tmp_path: Path) -> None:
    def run(*arguments: Any) -> int:
        return count_threads(size=10**6, minimum_size=1)

    results = list[int]()
    study: Any = SimpleNamespace(seed=0, directory=tmp_path)
    steps = THREADS.run(
        study,
        [cast(Any, SimpleNamespace(run=run)) for _ in range(tasks)],
        workers,
        CPU,
        lambda task, result: results.append(result),
    )
    assert list(steps) == []
    assert results == [threads] * tasks


@pytest.mark.parametrize("workers", [2, 3, 64])
def test_an_executor_starts_at_most_one_thread_per_task(workers: int, tmp_path: Path) -> None:
    n_tasks = 3
    before = set(threading.enumerate())
    started = set[threading.Thread]()

    def run(*arguments: Any) -> None:
        started.update(set(threading.enumerate()) - before)

    study: Any = SimpleNamespace(seed=0, directory=tmp_path)
    tasks = [cast(Any, SimpleNamespace(run=run)) for _ in range(n_tasks)]
    assert list(THREADS.run(study, tasks, workers, CPU)) == []
    assert 1 <= len(started) <= min(workers, n_tasks)


@pytest.mark.parametrize(("runs", "workers"), [(2, 16), (10, 4), (60, 2)])
def test_a_study_has_a_task_for_each_worker_or_for_each_run(
    runs: int, workers: int, tmp_path: Path
) -> None:
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=5)
    tasks = plan_tasks(study, {"evo/A": list(range(runs))}, workers)
    assert len(tasks) >= min(workers, runs)
    assert sorted(run for task in tasks for run in task.runs) == list(range(runs))


@pytest.mark.parametrize(
    ("runs", "sizes"),
    # With less than 64 runs, 16 threads would have less than one block of four worlds each.
    [(3, [1] * 3), (16, [1] * 16), (60, [3] * 20), (80, [20] * 4), (300, [60] * 5)],
)
def test_few_large_tasks_share_the_threads_of_one_process(
    runs: int, sizes: list[int], tmp_path: Path
) -> None:
    long_life = shorten_preset("evo/A").replace(lifetime={"steps": 300_000})
    study = create_study(tmp_path, [long_life], seed=5)
    tasks = plan_tasks(study, {"evo/A": list(range(runs))}, 16, has_shared_threads=True)
    assert [len(task.runs) for task in tasks] == sizes


@pytest.mark.parametrize(
    ("executor", "workers", "tasks", "sentence"),
    [
        (THREADS, 2, 180, "Workers: 2; usable cores: 16."),
        (THREADS, 16, 10, "Workers: 10; usable cores: 16."),
        (THREADS, 16, 3, "Workers: 3, each with up to 5 threads; usable cores: 16."),
        (THREADS._replace(name="dask"), 40, 180, "Workers: 40 (dask)."),
        (THREADS._replace(name="dask"), 40, 3, "Workers: 40 (dask)."),
    ],
)
def test_a_sentence_states_the_number_of_workers(
    executor: Executor, workers: int, tasks: int, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(executors, "available_cores", lambda: 16)
    assert describe_workers(executor, workers, tasks) == sentence


def test_while_a_task_waits_for_the_gpu_the_other_tasks_continue(tmp_path: Path) -> None:
    barrier = threading.Barrier(GPU_TASKS)

    class WaitingBatch(CpuBatch):
        """A batch whose lifetimes end only when all tasks have begun this generation."""

        def eaten_in_life(self) -> Any:
            eaten = super().eaten_in_life()
            # The compilation before the study simulates a single run.
            if len(eaten) > 1:
                barrier.wait(timeout=300)
            return eaten

    experiment = shorten_preset("evo/A")
    n_runs = 2 * GPU_TASKS
    gpu = Backend("cuda", WaitingBatch, worlds=1000, tasks=GPU_TASKS)
    waiting = make_small_study(
        tmp_path / "waiting", [experiment], n_runs, workers=GPU_TASKS, backend=gpu
    )
    expected = make_small_study(tmp_path / "expected", [experiment], n_runs)
    assert read_records(waiting.directory) == read_records(expected.directory)


@pytest.mark.parametrize(("runs", "sizes"), [(2_640, [660] * 4), (100_000, [6_250] * 16)])
def test_the_runs_of_a_condition_fill_the_tasks_of_a_gpu_but_not_all_workers(
    runs: int, sizes: list[int], tmp_path: Path
) -> None:
    study = make_small_study(tmp_path, [load("evo/A")], runs=0)
    tasks = plan_tasks(study, {"evo/A": list(range(runs))}, GPU_TASKS, GPU_WORLDS)
    assert [len(task.runs) for task in tasks] == sizes


@pytest.mark.parametrize(("agents", "batches"), [(2000, [1, 1, 1]), (1000, [2, 1]), (500, [3])])
def test_batches_of_large_populations_have_few_runs(
    agents: int, batches: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulated = list[int]()
    monkeypatch.setattr(
        RunTask, "_simulate_batch", lambda task, *arguments: simulated.append(len(arguments[-1]))
    )
    experiment = load("evo/A").replace(
        population={"size": agents}, lifetime={"steps": 1}, evolution={"generations": 1}
    )
    RunTask(experiment, runs=(0, 1, 2)).run(0, tmp_path, CPU, lambda agent_steps: None)
    assert simulated == batches


def test_stored_runs_are_not_repeated_when_a_study_grows(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "grown", runs=1)
    before = study.path("evo/A", 0).stat().st_mtime_ns
    assert find_missing_runs(study, 1, ignore_message) == {"evo/A": [], "evo+self-taught/A": []}
    assert find_missing_runs(study, 3, ignore_message) == {
        "evo/A": [1, 2],
        "evo+self-taught/A": [1, 2],
    }
    make_small_study(tmp_path / "grown", runs=3)
    assert study.path("evo/A", 0).stat().st_mtime_ns == before
    assert read_records(study.directory) == read_records(
        make_small_study(tmp_path / "whole", runs=3).directory
    )


def test_a_damaged_record_beyond_the_requested_runs_is_reported_and_moved(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, [shorten_preset("evo/A")], runs=2)
    misplaced = study.path("evo/A", 7)
    shutil.copy(study.path("evo/A", 1), misplaced)
    messages: list[str] = []
    assert find_missing_runs(study, 2, messages.append) == {"evo/A": []}
    (sentence,) = messages
    assert sentence.startswith(f"{misplaced} is damaged: it is run 1 of evo/A")
    assert sentence.endswith(
        "it is renamed to 0007.nc.damaged, and run 7 is not done again, as --runs is 2"
    )
    assert not misplaced.exists()
    assert misplaced.with_name("0007.nc.damaged").exists()
    open_runs(tmp_path)


def test_a_study_opens_as_a_labeled_dataset_and_records_its_session(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, runs=2, workers=2)
    runs = open_runs(tmp_path)
    assert dict(runs.food_eaten.sizes) == {"condition": 2, "run": 2, "generation": 3, "agent": 20}
    assert runs.attrs["seed"] == 5
    assert "[world]" in str(runs.experiment.sel(condition="evo/A").item())
    units = {name: runs[name].attrs["units"] for name in ("food_eaten", "energy", "parents")}
    assert units == {"food_eaten": "items", "energy": "energy", "parents": "1"}
    assert runs.food_eaten.attrs["long_name"] == "items eaten in life"
    assert all(runs[name].attrs["long_name"] for name in runs.dims)
    assert "units" not in fitness.share(runs).attrs, "a share has no unit"
    (session,) = study.sessions()
    assert session["agent_steps"] == 2 * 2 * 3 * 300 * 20
    assert session["workers"] == 2
    assert session["seconds"] > 0


def test_a_study_in_an_object_store_equals_a_study_in_a_folder(tmp_path: Path) -> None:
    pytest.importorskip("upath")
    in_store = make_small_study(parse_location("memory://tests/study"), runs=2)
    in_folder = make_small_study(tmp_path, runs=2)
    xr.testing.assert_identical(open_runs("memory://tests/study"), open_runs(tmp_path))
    for condition in in_folder.experiments:
        assert in_store.path(condition, 1).read_bytes() == in_folder.path(condition, 1).read_bytes()
    path = in_store.path("evo/A", 1)
    path.write_bytes(path.read_bytes()[:-100])
    messages: list[str] = []
    assert find_missing_runs(in_store, 2, messages.append) == {
        "evo/A": [1],
        "evo+self-taught/A": [],
    }
    assert "memory://tests/study/runs/evo/A/0001.nc is damaged" in messages[0]
    assert path.with_name("0001.nc.damaged").exists()
    make_small_study(parse_location("memory://tests/study"), runs=2)
    xr.testing.assert_identical(open_runs(in_store.directory), open_runs(tmp_path))
    assert len(list(in_store.sessions())) == 2
    with pytest.raises(StudyError, match="memory://tests/study holds another study"):
        create_study(parse_location("memory://tests/study"), [shorten_preset("evo/A")], seed=5)


# Interrupts the main thread when its function number N returns, for all N until the first event.
INTERRUPTED_TASKS = """
import signal, sys, time
from types import SimpleNamespace
from baldwinlab.studies.executors import run_on_threads


class Task:
    def run(self, seed, directory, backend, report_progress):
        # Only an interruption ends the task.
        while True:
            report_progress(1)
            time.sleep(0.001)


def interrupt(number):
    returns = 0

    def trace(frame, event, argument):
        nonlocal returns
        # Without the generator's own returns, after which no code of it would run.
        returns += event == "return" and frame.f_code is not run_on_threads.__code__
        if returns == number:
            sys.settrace(None)
            signal.raise_signal(signal.SIGINT)
        return trace

    study = SimpleNamespace(seed=1, directory=None)
    events = run_on_threads(study, [Task(), Task(), Task()], 2, None, None)
    sys.settrace(trace)
    try:
        next(events)
        return False
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(None)
        events.close()


# A shell ignores the signal in background jobs.
signal.signal(signal.SIGINT, signal.default_int_handler)
number = 1
while interrupt(number):
    number += 1
print(number)
"""


def test_an_interruption_at_any_moment_of_the_start_stops_all_threads() -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_TASKS],
        capture_output=True,
        text=True,
        # The limit only ends a program that hangs.
        timeout=180,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 50
