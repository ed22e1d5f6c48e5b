"""A live run shows its generations as they live, obeys, is kept as the study it is, and is freed when nobody watches."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from weakref import ref

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.statistics import fitness
from baldwinlab.experiment import Experiment
from baldwinlab.lab import MissingError
from baldwinlab.lab.experiment_form import find_errors
from baldwinlab.lab.limits import check_size, memory_of, steps_at_once
from baldwinlab.lab.live import Live
from baldwinlab.lab.live_run import LiveRun
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study, read_records, shorten_preset

LONG = {"evolution": {"generations": 1000}, "lifetime": {"steps": 50}}
BRISK = 0.02  # seconds a generation: it can be stopped on the way


def wait_until(what: Callable[[], bool]) -> None:
    until = time.monotonic() + 60
    while not what():
        assert time.monotonic() < until, "it did not come about"
        time.sleep(0.005)


@pytest.fixture
def live() -> Iterator[Live]:
    runs = Live()
    yield runs
    runs.close()


def ended(run: LiveRun) -> LiveRun:
    wait_until(lambda: run.ended)
    return run


def stopped(live: Live, experiment: Experiment, runs: int = 2) -> LiveRun:
    run = live.start(experiment, seed=3, runs=runs, seconds=BRISK)
    wait_until(lambda: run.generations_done >= 3)
    run.stop()
    return ended(run)


def test_a_live_run_that_is_kept_is_the_study_that_the_command_line_makes(
    live: Live, tmp_path: Path
) -> None:
    run = ended(live.start(shorten_preset(), seed=5, runs=3))
    assert run.state == "done"
    live.save(run.id, tmp_path, "kept/one")
    asked = make_small_study(tmp_path / "asked", [shorten_preset()], runs=3, seed=5)
    assert read_records(tmp_path / "kept/one") == read_records(asked.directory)
    assert StudyStore(tmp_path / "kept/one").experiments == asked.experiments


@pytest.mark.parametrize("every", [1, 2, 100])
def test_a_live_run_that_is_stopped_is_kept_with_the_generations_that_it_lived(
    live: Live, tmp_path: Path, every: int
) -> None:
    run = stopped(live, shorten_preset("evo/A").replace(**LONG, record={"genome_every": every}))
    assert run.state == "stopped"
    live.save(run.id, tmp_path, "short")
    study = StudyStore(tmp_path / "short")
    kept = study.experiment("evo/A")
    assert kept == run.experiment.replace(evolution={"generations": run.generations_done})
    for number in range(2):
        xr.testing.assert_identical(study.read("evo/A", number), simulate(kept, seed=3, run=number))


@pytest.mark.parametrize(("runs", "parts"), [(1, ["mean"]), (3, ["mean", "low", "high", "runs"])])
def test_the_measures_of_a_live_run_are_those_of_the_analysis(
    live: Live, tmp_path: Path, runs: int, parts: list[str]
) -> None:
    run = ended(live.start(shorten_preset(), seed=5, runs=runs))
    live.save(run.id, tmp_path, "kept")
    study = open_runs(tmp_path / "kept").isel(condition=0)
    measures = run.measures(1, 3)
    assert list(measures) == ["best", "mean", "share"]
    for name, band in measures.items():
        assert list(band) == parts
        values = fitness.MEASURES[name](study)
        for edge, expected in zip(band.values(), fitness.interval_of_mean(values), strict=False):
            assert np.allclose(edge, expected.values[1:3])
        if runs > 1:
            assert np.allclose(band["runs"], values.values.T[1:3])


@pytest.fixture
def endless(live: Live) -> LiveRun:
    """A run in the middle of a life that would take hours, among half a million items."""
    many = {"population": {"size": 1}, "lifetime": {"steps": 100_000_000}}
    food = {"x": [400, 560], "y": [80, 240], "count": 500_000}
    run = live.start(
        shorten_preset("evo/A").replace(**many, world={"food": [food]}), seed=0, runs=1
    )
    wait_until(lambda: run.state == "running")
    time.sleep(0.3)
    return run


def test_a_live_run_stops_within_a_second_in_the_middle_of_a_life(endless: LiveRun) -> None:
    asked = time.monotonic()
    endless.stop()
    endless.wait()
    assert time.monotonic() - asked < 1
    assert (endless.state, endless.generations_done) == ("stopped", 0)


def test_a_live_run_pauses_within_a_second_in_the_middle_of_a_life(
    endless: LiveRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    lived, really = [0], CpuBatch.simulate

    def counted(batch: CpuBatch, first: int, last: int) -> None:
        lived[0] += 1
        really(batch, first, last)

    monkeypatch.setattr(CpuBatch, "simulate", counted)
    wait_until(lambda: lived[0] > 3)
    endless.pause()
    time.sleep(1)
    before = lived[0]
    time.sleep(0.3)
    assert lived[0] == before
    endless.resume()
    wait_until(lambda: lived[0] > before)


def test_lives_in_pieces_have_the_bits_of_whole_ones(
    live: Live, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("baldwinlab.lab.live_run.steps_at_once", lambda experiment, runs: 7)
    live.save(ended(live.start(shorten_preset(), seed=5, runs=3)).id, tmp_path, "pieces")
    assert read_records(tmp_path / "pieces") == read_records(
        make_small_study(tmp_path / "whole", [shorten_preset()], runs=3, seed=5).directory
    )


def test_a_piece_is_shorter_where_a_step_takes_longer() -> None:
    most = [
        steps_at_once(shorten_preset().replace(population={"size": size}), 1)
        for size in (20, 200, 200_000)
    ]
    assert most[0] > 9 * most[1] > 0
    assert most[2] >= 1


def test_live_runs_that_have_ended_count_until_they_give_way(
    live: Live, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("baldwinlab.lab.live.MAX_MEMORY", 2 * memory_of(shorten_preset(), 1))
    first, second = (ended(live.start(shorten_preset(), seed=seed, runs=1)) for seed in range(2))
    with (
        live.watch(first.id),
        live.watch(second.id),
        pytest.raises(ValueError, match=r"live runs may use .* bytes of memory in total"),
    ):
        live.start(shorten_preset(), seed=2, runs=1)
    assert live.all() == [first, second]
    with live.watch(first.id):
        third = live.start(shorten_preset(), seed=2, runs=1)
    assert live.all() == [first, third]


def test_a_live_run_pauses_and_goes_on(live: Live) -> None:
    run = live.start(shorten_preset().replace(**LONG), seed=1, runs=1, seconds=BRISK)
    wait_until(lambda: run.generations_done > 0)
    run.pause()
    assert run.state == "paused"
    time.sleep(3 * BRISK)
    before = run.generations_done
    time.sleep(5 * BRISK)
    assert run.generations_done <= before + 1
    run.resume()
    wait_until(lambda: run.generations_done > before + 2)
    assert run.state == "running"
    run.stop()
    run.pause()  # too late
    assert ended(run).state == "stopped"


def test_a_live_run_keeps_the_pace_that_it_is_told(live: Live) -> None:
    run = live.start(shorten_preset().replace(**LONG), seed=1, runs=1, seconds=60)
    wait_until(lambda: run.generations_done == 1)
    run.handle_command({"do": "pace", "seconds": 0})
    assert ended(run).state == "done"
    with pytest.raises(ValueError, match="seconds = 'soon' must be a number from 0 to 60"):
        run.handle_command({"do": "pace", "seconds": "soon"})


def test_a_generation_of_a_live_run_replays_to_the_bit(live: Live) -> None:
    run = stopped(live, shorten_preset().replace(**LONG))
    experiment, seed, number, energy = live.recording_source(run.id, 1, 2)
    trace = replay(experiment, seed=seed, run=number, generation=2, energy=energy)
    assert np.array_equal(trace.eaten.sum("step"), run.records()[1].food_eaten[2])
    with pytest.raises(
        ValueError,
        match=f"generation {run.generations_done} .* is not finished: {run.generations_done} generations are",
    ):
        live.recording_source(run.id, 0, run.generations_done)
    with pytest.raises(ValueError, match="run = 2 must be at least 0 and less than 2"):
        live.recording_source(run.id, 2, 0)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("", "is not a valid name of a study"),
        ("../outside", "is not a valid name of a study"),
        ("/tmp/outside", "is not a valid name of a study"),
        ("a\\b", "is not a valid name of a study"),
        ("study.toml", "is not a valid name of a study"),
        ("some/runs/here", "no folder called runs"),
        ("a" * 101, "at most 100"),
        ("link/outside", "leads out of"),
        ("taken", "exists already"),
    ],
)
def test_a_live_run_is_kept_only_in_a_new_folder_of_the_root(
    live: Live, tmp_path: Path, name: str, sentence: str
) -> None:
    root = tmp_path / "root"
    (root / "taken").mkdir(parents=True)
    (root / "link").symlink_to(tmp_path)
    run = ended(live.start(shorten_preset().replace(evolution={"generations": 1}), seed=0, runs=1))
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(StudyError, match=sentence):
        live.save(run.id, root, name)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_live_run_is_not_kept_while_it_lives(live: Live, tmp_path: Path) -> None:
    run = live.start(shorten_preset().replace(**LONG), seed=0, runs=1, seconds=BRISK)
    with pytest.raises(StudyError, match="only a run that is done or stopped can be saved"):
        live.save(run.id, tmp_path, "kept")


def test_only_a_few_live_runs_live_at_once(live: Live) -> None:
    runs = [
        live.start(shorten_preset().replace(**LONG), seed=0, runs=1, seconds=BRISK)
        for _ in range(4)
    ]
    with pytest.raises(
        ValueError, match="4 live runs are active, and no more are allowed; stop one of them first"
    ):
        live.start(shorten_preset(), seed=0, runs=1)
    runs[0].stop()
    ended(runs[0])
    live.start(shorten_preset(), seed=0, runs=1)


@pytest.mark.parametrize(
    ("changes", "runs", "sentence"),
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
        (
            {"world": {"food": [{"x": [0, 9], "y": [0, 9], "count": 500_001}]}},
            1,
            "500,000 food items",
        ),
        (
            {
                "population": {"size": 9000},
                "world": {"food": [{"x": [0, 9], "y": [0, 9], "count": 9000}]},
            },
            1,
            "visible items",
        ),
        (
            {"population": {"size": 50_000}, "lifetime": {"steps": 1}},
            1,
            "500,000,000 bytes of memory",
        ),
    ],
)
def test_what_is_too_large_to_watch_is_refused(
    changes: dict[str, Any], runs: int, sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        check_size(Experiment().replace(**changes), runs)


def test_a_live_run_that_nobody_watches_is_stopped_and_freed() -> None:
    live = Live(grace=0.05)
    run = live.start(shorten_preset().replace(**LONG), seed=0, runs=1, seconds=BRISK)
    with live.watch(run.id):
        with live.watch(run.id):
            time.sleep(0.1)
        time.sleep(0.1)
        assert live.run(run.id) is run  # one of the two still watches
    wait_until(lambda: live.all() == [])
    assert ended(run).state == "stopped"
    with pytest.raises(MissingError, match="there is no live run"):
        live.run(run.id)
    left = ref(run)
    del run
    wait_until(lambda: gc.collect() >= 0 and left() is None)


def test_a_page_that_comes_back_in_time_finds_its_run() -> None:
    live = Live(grace=2)
    run = live.start(shorten_preset().replace(**LONG), seed=0, runs=1, seconds=BRISK)
    for _ in range(5):
        with live.watch(run.id):
            pass
        time.sleep(0.5)
    with live.watch(run.id):
        time.sleep(2.5)
        assert not run.ended
    live.close()


def test_a_live_run_that_fails_says_why(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: object) -> None:
        raise MemoryError("no room")

    monkeypatch.setattr("baldwinlab.lab.live_run.simulate_histories", fail)
    run = ended(live.start(shorten_preset(), seed=0, runs=1))
    assert (run.state, run.message) == ("failed", "the live run failed: no room")


def test_every_fault_of_an_experiment_is_told_with_the_field_it_is_about() -> None:
    tree = shorten_preset().to_dict()
    tree["senses"]["visual_radius"] = 400
    assert find_errors(tree)[0]["path"] == "senses.visual_radius"
    tree["world"]["food"][0]["count"] = -1
    tree["lifetime"]["steps"] = "many"
    found = {fault["path"]: fault["message"] for fault in find_errors(tree)}
    assert (
        found["world.food.0.count"]
        == "world.food.0.count = -1: input should be greater than or equal to 0"
    )
    assert set(found) == {"world.food.0.count", "lifetime.steps"}
    assert find_errors(shorten_preset().to_dict()) == []
    assert find_errors(3)[0]["path"] == ""
