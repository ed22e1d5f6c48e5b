"""Test that a team of threads gives the bits of a single thread."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt
import pytest

from baldwinlab.engine.threads import use_threads
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import make_model, named_arrays
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.parallel_step import MIN_SHARED_ITEMS, TILE_LANES
from tests.evolution.single_runs import draw_genomes
from tests.worlds import make_small_experiment

STEPS = 40
# All threads sort the first region together. A thread sorts the second one. The third one has a
# single cell.
REGIONS = [
    {"x": [0, 160], "y": [0, 200], "count": MIN_SHARED_ITEMS + 3},
    {"x": [170, 230], "y": [20, 80], "count": 200},
    {"x": [100, 220], "y": [50, 90], "count": 20},
]
ONE_RULE: dict[str, Any] = {"learning": {"rule": "self-taught"}, "motor": {"noise": 0.1}}
WALL = (40, 44, 20, 150)


def make_world(condition: str = "evo", size: int = 1100, **changes: Any) -> Experiment:
    """Return an experiment whose agents see items, compete and eat."""
    world = {
        "width": 240,
        "height": 200,
        "start": {"x": 100, "y": 90, "radius": 90},
        "food": REGIONS,
    }
    settings = {
        "world": world | changes.pop("world", {}),
        "population": {"size": size},
        "senses": {"visual_radius": 6} | changes.pop("senses", {}),
        "contact": {"reach": 2},
        "lifetime": {"steps": STEPS},
    }
    return make_small_experiment(condition, **settings | changes)


@pytest.fixture
def simulate(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that simulates two lifetimes, and returns the arrays after the second.

    On one thread, the step of small worlds simulates them.
    """

    def simulate_world(experiment: Experiment, threads: int) -> dict[str, npt.NDArray[Any]]:
        monkeypatch.setattr(cpu, "MIN_AGENTS", 1)
        monkeypatch.setattr(cpu, "MIN_AGENTS_PER_THREAD", 0.1)
        with use_threads(threads):
            batch = CpuBatch(experiment, seed=3, runs=[1])
        for generation in range(2):
            genomes = draw_genomes(experiment, GenerationKey(3, 1, generation))
            batch.begin(generation, genomes[None])
            batch.simulate(0, STEPS // 2)
            batch.simulate(STEPS // 2, STEPS)
        return named_arrays(batch.state, 1, experiment.population.size)

    return simulate_world


def assert_equal_bits(
    arrays: dict[str, npt.NDArray[Any]], expected: dict[str, npt.NDArray[Any]]
) -> None:
    assert arrays.keys() == expected.keys()
    different = [name for name in arrays if arrays[name].tobytes() != expected[name].tobytes()]
    assert different == []


def test_any_number_of_threads_gives_equal_bits(simulate: Any) -> None:
    experiment = make_world(**ONE_RULE)
    assert experiment.population.size > 2 * TILE_LANES
    cells = make_model(experiment, 1).grid.prod(axis=1)
    assert (cells[:2] > 1).all() and cells[2] == 1
    expected = simulate(experiment, 1)
    assert (expected["eaten_in_life"].sum(axis=1) > 0).all()
    for threads in (2, 3, 5):
        assert_equal_bits(simulate(experiment, threads), expected)


@pytest.mark.parametrize(
    "experiment",
    [
        make_world(size=1, **ONE_RULE),
        make_world(size=3, **ONE_RULE),
        make_world(size=100, world={"food": []}, **ONE_RULE),
    ],
    ids=["one agent", "fewer agents than threads", "no food"],
)
def test_extreme_worlds_have_equal_bits(experiment: Experiment, simulate: Any) -> None:
    expected = simulate(experiment, 1)
    for threads in (2, 5):
        assert_equal_bits(simulate(experiment, threads), expected)


BIRTHS: dict[str, Any] = {
    "features": ["births-and-deaths", "walls"],
    "births_and_deaths": {"max_age": 30, "initial_energy": 2.0},
    "walls": {"boxes": [WALL]},
}


@pytest.mark.parametrize(
    "experiment",
    [
        make_world(size=300, world=BIRTHS, **ONE_RULE),
        make_world(size=300, learning={"rule": "imitation"}, senses={"kinds": ["food", "compass"]}),
        make_world(
            size=300,
            learning={"rule": "hebb", "control": "yoked"},
            senses={"kinds": ["food", "neighbours"]},
            contact={"shape": "square", "reach": 2},
        ),
        make_world(size=300, senses={"kinds": ["nearest", "smell", "touch"]}),
        make_world(
            size=300, network={"kind": "neat", "hidden": [40]}, evolution={"variation": "neat"}
        ),
    ],
    ids=["births and walls", "imitation", "yoked control", "real-valued senses", "neat"],
)
@pytest.mark.nightly
def test_parts_have_equal_bits(experiment: Experiment, simulate: Any) -> None:
    expected = simulate(experiment, 1)
    assert_equal_bits(simulate(experiment, 3), expected)
