"""Tests of live runs: their control, measures, storage, limits and removal."""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from weakref import ref

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.statistics import fitness, intervals
from baldwinlab.experiment import Experiment
from baldwinlab.lab import MissingError
from baldwinlab.lab.sources import live_run
from baldwinlab.lab.sources.experiment_form import find_errors
from baldwinlab.lab.sources.limits import check_size, count_uninterrupted_steps, estimate_memory
from baldwinlab.lab.sources.live import Live
from baldwinlab.lab.sources.live_run import LiveRun
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.lab.client import wait_until
from tests.small_studies import make_small_study, read_records, shorten_preset

# With this pace, in seconds per generation, a long run takes minutes. Tests stop it.
LONG = {"evolution": {"generations": 10_000}, "lifetime": {"steps": 50}}
PACE = 0.02


@pytest.fixture
def live() -> Iterator[Live]:
    runs = Live()
    yield runs
    runs.close()


def start(
    live: Live, experiment: Experiment | None = None, seed: int = 0, n_runs: int = 1
) -> LiveRun:
    return live.start(experiment or shorten_preset(), seed=seed, n_runs=n_runs)


def start_long(live: Live, experiment: Experiment | None = None, n_runs: int = 1) -> LiveRun:
    long = experiment or shorten_preset().replace(**LONG)
    return live.start(long, seed=3, n_runs=n_runs, seconds_per_generation=PACE)


def wait_for_end(run: LiveRun) -> LiveRun:
    wait_until(lambda: run.has_ended)
    return run


def run_and_stop(live: Live, experiment: Experiment) -> LiveRun:
    """Start two live runs, stop them after three generations, and return them."""
    run = start_long(live, experiment, n_runs=2)
    wait_until(lambda: run.generations_done >= 3)
    run.stop()
    return wait_for_end(run)


@pytest.mark.parametrize("steps_per_block", [None, 7])
def test_a_saved_live_run_is_identical_to_a_study_of_the_command_line(
    live: Live, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, steps_per_block: int | None
) -> None:
    if steps_per_block is not None:
        monkeypatch.setattr(
            live_run, "count_uninterrupted_steps", lambda experiment, n_runs: steps_per_block
        )
    run = wait_for_end(start(live, seed=5, n_runs=3))
    assert run.state == "done"
    live.save(run.id, tmp_path, "saved/study")
    expected = make_small_study(tmp_path / "expected", [shorten_preset()], runs=3, seed=5)
    assert read_records(tmp_path / "saved/study") == read_records(expected.directory)
    assert StudyStore(tmp_path / "saved/study").experiments == expected.experiments


@pytest.mark.parametrize("every", [1, 2, 100])
def test_a_stopped_live_run_is_saved_with_its_finished_generations(
    live: Live, tmp_path: Path, every: int
) -> None:
    experiment = shorten_preset("evo/A").replace(**LONG, record={"genome_every": every})
    run = run_and_stop(live, experiment)
    assert run.state == "stopped"
    live.save(run.id, tmp_path, "short")
    study = StudyStore(tmp_path / "short")
    experiment = study.experiment("evo/A")
    assert experiment == run.experiment.replace(evolution={"generations": run.generations_done})
    for number in range(2):
        xr.testing.assert_identical(
            study.read("evo/A", number), simulate(experiment, seed=3, run=number)
        )


@pytest.mark.parametrize(("runs", "parts"), [(1, ["mean"]), (3, ["mean", "low", "high", "runs"])])
def test_the_measures_of_a_live_run_are_those_of_the_analysis(
    live: Live, tmp_path: Path, runs: int, parts: list[str]
) -> None:
    run = wait_for_end(start(live, seed=5, n_runs=runs))
    live.save(run.id, tmp_path, "saved")
    study = open_runs(tmp_path / "saved").isel(condition=0)
    measures = run.compute_measures(1, 3)
    assert list(measures) == ["best", "mean", "share"]
    for name, band in measures.items():
        assert list(band) == parts
        values = fitness.MEASURES[name](study)
        for edge, expected in zip(band.values(), intervals.interval_of_mean(values), strict=False):
            assert np.allclose(edge, expected.values[1:3])
        if runs > 1:
            assert np.allclose(band["runs"], values.values.T[1:3])


@pytest.fixture
def waiting_threads(monkeypatch: pytest.MonkeyPatch) -> list[threading.Thread]:
    """Return the threads that have waited for an event without a limit of time."""
    threads = list[threading.Thread]()
    wait = threading.Event.wait

    def wait_and_record(event: threading.Event, timeout: float | None = None) -> bool:
        if timeout is None and not event.is_set():
            threads.append(threading.current_thread())
        return wait(event, timeout)

    monkeypatch.setattr(threading.Event, "wait", wait_and_record)
    return threads


@pytest.fixture
def simulating_threads(monkeypatch: pytest.MonkeyPatch) -> list[threading.Thread]:
    """Return the thread of each call that simulates a block of steps."""
    threads = list[threading.Thread]()
    simulate_steps = CpuBatch.simulate

    def simulate_and_record(batch: CpuBatch, first: int, last: int) -> None:
        threads.append(threading.current_thread())
        simulate_steps(batch, first, last)

    monkeypatch.setattr(CpuBatch, "simulate", simulate_and_record)
    return threads


@pytest.fixture
def endless(live: Live, simulating_threads: list[threading.Thread]) -> LiveRun:
    """Start a run whose first lifetime would take hours, with half a million items."""
    many = {"population": {"size": 1}, "lifetime": {"steps": 100_000_000}}
    food = {"x": [400, 560], "y": [80, 240], "count": 500_000}
    run = start(live, shorten_preset("evo/A").replace(**many, world={"food": [food]}))
    wait_until(lambda: len(simulating_threads) > 3)
    return run


def test_a_live_run_stops_during_a_lifetime(endless: LiveRun) -> None:
    endless.stop()
    endless.wait()
    assert (endless.state, endless.generations_done) == ("stopped", 0)


def test_a_live_run_pauses_during_a_lifetime(
    endless: LiveRun,
    simulating_threads: list[threading.Thread],
    waiting_threads: list[threading.Thread],
) -> None:
    endless.pause()
    wait_until(lambda: simulating_threads[0] in waiting_threads)
    assert (endless.state, endless.generations_done) == ("paused", 0)
    before = len(simulating_threads)
    endless.resume()
    wait_until(lambda: len(simulating_threads) > before)


def test_a_block_has_fewer_steps_if_a_step_takes_longer() -> None:
    experiments = [
        shorten_preset().replace(population={"size": size}) for size in (20, 200, 200_000)
    ]
    steps = [count_uninterrupted_steps(experiment, 1) for experiment in experiments]
    assert steps[0] > 9 * steps[1] > 0
    assert steps[2] >= 1


def test_ended_live_runs_use_memory_until_a_new_run_replaces_them(
    live: Live, monkeypatch: pytest.MonkeyPatch
) -> None:
    limit = 2 * estimate_memory(shorten_preset(), 1)
    monkeypatch.setattr("baldwinlab.lab.sources.live.MAX_TOTAL_BYTES", limit)
    first, second = (wait_for_end(start(live)) for _ in range(2))
    with (
        live.watch(first.id),
        live.watch(second.id),
        pytest.raises(ValueError, match=r"live runs may use .* bytes of memory in total"),
    ):
        start(live)
    assert live.list_runs() == [first, second]
    with live.watch(first.id):
        third = start(live)
    assert live.list_runs() == [first, third]


def test_a_live_run_pauses_and_resumes(live: Live, waiting_threads: list[threading.Thread]) -> None:
    run = start_long(live)
    wait_until(lambda: run.generations_done > 0)
    run.pause()
    assert run.state == "paused"
    wait_until(lambda: len(waiting_threads) > 0)
    before = run.generations_done
    run.resume()
    wait_until(lambda: run.generations_done > before + 2)
    assert run.state == "running"
    run.stop()
    # A pause after the stop has no effect.
    run.pause()
    assert wait_for_end(run).state == "stopped"


def test_a_command_changes_the_pace_of_a_live_run(live: Live) -> None:
    run = live.start(shorten_preset(), seed=1, n_runs=1, seconds_per_generation=60)
    wait_until(lambda: run.generations_done == 1)
    run.handle_command({"command": "pace", "seconds": 0})
    assert wait_for_end(run).state == "done"
    with pytest.raises(ValueError, match="seconds = 'soon' must be a number from 0 to 60"):
        run.handle_command({"command": "pace", "seconds": "soon"})


def test_the_replay_of_a_generation_of_a_live_run_is_bit_identical(live: Live) -> None:
    run = run_and_stop(live, shorten_preset().replace(**LONG))
    fitness = run.read_fitness(1, 2)
    trace = replay(run.experiment, seed=run.seed, run=1, generation=2, energy=fitness)
    assert np.array_equal(trace.eaten.sum("step"), run.make_records()[1].food_eaten[2])
    n_done = run.generations_done
    message = f"generation {n_done} .* is not finished: {n_done} generations are"
    with pytest.raises(ValueError, match=message):
        run.read_fitness(0, n_done)
    with pytest.raises(ValueError, match="run = 2 must be at least 0 and less than 2"):
        run.read_fitness(2, 0)


def test_a_live_run_is_saved_after_its_end_and_only_in_a_new_folder_of_the_root(
    live: Live, tmp_path: Path
) -> None:
    root = tmp_path / "root"
    (root / "taken").mkdir(parents=True)
    (root / "link").symlink_to(tmp_path)
    active = start_long(live)
    ended = wait_for_end(start(live, shorten_preset().replace(evolution={"generations": 1})))
    before = sorted(tmp_path.rglob("*"))
    for run, name, message in (
        (active, "saved", "only a run that is done or stopped can be saved"),
        (ended, "", "is not a valid name of a study"),
        (ended, "../outside", "is not a valid name of a study"),
        (ended, "/tmp/outside", "is not a valid name of a study"),
        (ended, "a\\b", "is not a valid name of a study"),
        (ended, "study.toml", "is not a valid name of a study"),
        (ended, "some/runs/here", "no folder called runs"),
        (ended, "some/Nul", "Windows reserves 'Nul' for a device"),
        (ended, "a" * 101, "at most 100"),
        (ended, "link/outside", "leads out of"),
        (ended, "taken", "exists already"),
    ):
        with pytest.raises(StudyError, match=message):
            live.save(run.id, root, name)
        assert sorted(tmp_path.rglob("*")) == before


def test_at_most_four_live_runs_are_active(live: Live) -> None:
    runs = [start_long(live) for _ in range(4)]
    message = "4 live runs are active, and no more are allowed; stop one of them first"
    with pytest.raises(ValueError, match=message):
        start(live)
    runs[0].stop()
    wait_for_end(runs[0])
    start(live)


def count_food(count: int) -> dict[str, Any]:
    return {"food": [{"x": [0, 9], "y": [0, 9], "count": count}]}


@pytest.mark.parametrize(
    ("changes", "runs", "message"),
    [
        ({}, 0, "runs = 0 must be at least 1 and at most 50"),
        ({}, 51, "runs = 51 must be at least 1 and at most 50"),
        (
            {"evolution": {"generations": 10_001}},
            1,
            "10,000 generations, and this one would have 10,001",
        ),
        ({"lifetime": {"steps": 100_000_000}}, 1, "runs x agents x steps x weights"),
        ({"network": {"hidden": [1000, 1000]}}, 1, "runs x agents x steps x weights"),
        ({"world": count_food(500_001)}, 1, "500,000 food items"),
        ({"population": {"size": 9000}, "world": count_food(9000)}, 1, "visible items"),
        (
            {"population": {"size": 50_000}, "lifetime": {"steps": 1}},
            1,
            "500,000,000 bytes of memory",
        ),
    ],
)
def test_an_experiment_that_is_too_large_for_a_live_run_is_rejected(
    changes: dict[str, Any], runs: int, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        check_size(Experiment().replace(**changes), runs)


def test_a_live_run_continues_without_a_page_until_it_is_removed(live: Live) -> None:
    run = start_long(live)
    with live.watch(run.id):
        n_done = run.generations_done
    # No page watches the run any more.
    wait_until(lambda: live.list_runs()[0].generations_done > n_done)
    assert live.list_runs() == [run]
    live.remove(run.id)
    assert (run.state, live.list_runs()) == ("stopped", [])
    with pytest.raises(MissingError, match="there is no live run"):
        live.find_run(run.id)
    reference = ref(run)
    del run
    wait_until(lambda: gc.collect() >= 0 and reference() is None)


def test_a_new_live_run_replaces_saved_runs_and_then_the_oldest_ones(
    live: Live, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("baldwinlab.lab.sources.live.MAX_STORED_RUNS", 3)
    first, second, third = (wait_for_end(start(live)) for _ in range(3))
    live.save(second.id, tmp_path, "second")
    fourth = wait_for_end(start(live))
    assert live.list_runs() == [first, third, fourth]
    fifth = wait_for_end(start(live))
    assert live.list_runs() == [third, fourth, fifth]
    with ExitStack() as pages:
        for run in live.list_runs():
            pages.enter_context(live.watch(run.id))
        with pytest.raises(ValueError, match=r"the lab stores at most 3 live runs"):
            start(live)


def test_a_failed_live_run_has_an_error_message(
    live: Live, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*arguments: object, **options: object) -> None:
        raise MemoryError("out of memory")

    monkeypatch.setattr("baldwinlab.lab.sources.live_run.simulate_histories", fail)
    run = wait_for_end(start(live))
    assert (run.state, run.message) == ("failed", "the live run failed: out of memory")


def test_every_error_of_an_experiment_has_the_path_of_its_field() -> None:
    settings = shorten_preset().to_dict()
    settings["senses"]["visual_radius"] = 400
    assert find_errors(settings)[0]["path"] == "senses.visual_radius"
    settings["world"]["food"][0]["count"] = -1
    settings["lifetime"]["steps"] = "many"
    messages = {error["path"]: error["message"] for error in find_errors(settings)}
    expected = "world.food.0.count = -1: input should be greater than or equal to 0"
    assert messages["world.food.0.count"] == expected
    assert set(messages) == {"world.food.0.count", "lifetime.steps"}
    assert find_errors(shorten_preset().to_dict()) == []
    assert find_errors(3)[0]["path"] == ""
