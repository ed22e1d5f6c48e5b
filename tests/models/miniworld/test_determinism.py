"""Test that one experiment and seed give the same bits in any batch, on any thread and in any order."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr

from baldwinlab.experiment import Experiment
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate, simulate_batch
from tests.worlds import make_small_experiment

RUNS = [0, 1, 2, 3, 7, 1000]
GROUPINGS = ([RUNS], [RUNS[::-1]], [RUNS[:1], RUNS[1:]], [[7, 0], [1000, 2, 3], [1]])
CONTROLS = {
    "learning": {
        "rule": "drift",
        "evolved_rate": True,
        "teacher": "shuffled",
        "cost_per_change": 0.5,
        "steps": 50,
    },
    "motor": {"noise": 0.2},
    "evolution": {"lamarckian_share": 0.5},
    "world": {"start": {"headings": "random"}},
}

every_kind_of_life = pytest.mark.parametrize(
    "experiment",
    [
        make_small_experiment(condition, lifetime={"update": update}, population={"size": size})
        for condition in ("evo", "evo+self-taught")
        for update in ("simultaneous", "sequential")
        for size in (1, 6, 17)
    ]
    + [
        make_small_experiment("evo+self-taught", **CONTROLS, lifetime={"update": update})
        for update in ("simultaneous", "sequential")
    ],
    ids=lambda experiment: (
        f"{experiment.name}-{experiment.lifetime.update}-{experiment.population.size}"
    ),
)


def assert_same_bits(one: xr.Dataset, other: xr.Dataset) -> None:
    for name in one.variables:
        assert one[name].values.tobytes() == other[name].values.tobytes(), name
    assert one.attrs == other.attrs


@every_kind_of_life
def test_a_run_has_the_same_bits_in_any_company(experiment: Experiment) -> None:
    alone = {run: simulate(experiment, seed=9, run=run) for run in RUNS}
    assert len({result["genome"].values.tobytes() for result in alone.values()}) == len(RUNS)
    assert sum(int(result["food_eaten"].sum()) for result in alone.values()) > 0
    for grouping in GROUPINGS:
        for group in grouping:
            for run, result in zip(group, simulate_batch(experiment, 9, group), strict=True):
                assert_same_bits(result, alone[run])


def test_threads_do_not_change_a_bit() -> None:
    experiments = [
        make_small_experiment(
            "evo+self-taught", network={"hidden": [width]}, lifetime={"steps": 300}
        )
        for width in (2, 4, 10, 5)
    ]
    alone = [simulate(experiment, seed=3, run=run) for experiment in experiments for run in RUNS]
    with ThreadPoolExecutor(4) as pool:
        together = list(
            pool.map(
                lambda task: simulate(task[0], seed=3, run=task[1]),
                [(each, run) for each in experiments for run in RUNS],
            )
        )
    for one, other in zip(alone, together, strict=True):
        assert_same_bits(one, other)


@pytest.mark.parametrize("condition", ["evo", "evo+self-taught", "self-taught"])
@pytest.mark.parametrize("generation", [0, 1, 2])
def test_a_replay_from_what_was_eaten_is_the_replay_from_the_seed(
    condition: str, generation: int
) -> None:
    experiment = make_small_experiment(condition, evolution={"mutation_rate": 0.5})
    energy = simulate(experiment, seed=4, run=2)["energy"]
    assert energy.sum() > 0
    assert_same_bits(
        replay(experiment, seed=4, run=2, generation=generation, energy=energy),
        replay(experiment, seed=4, run=2, generation=generation),
    )


def test_a_longer_run_begins_as_a_shorter_one() -> None:
    short = simulate(make_small_experiment("evo+self-taught", evolution={"generations": 2}), seed=8)
    long = simulate(make_small_experiment("evo+self-taught", evolution={"generations": 4}), seed=8)
    for name in ("food_eaten", "energy", "parents", "genome"):
        np.testing.assert_array_equal(long[name][:2], short[name])


@pytest.mark.parametrize("condition", ["evo", "evo+self-taught"])
@pytest.mark.parametrize("seed", range(5))
def test_for_one_agent_simultaneous_and_sequential_lives_are_the_same(
    condition: str, seed: int
) -> None:
    traces = [
        replay(
            make_small_experiment(
                condition,
                population={"size": 1},
                lifetime={"steps": 500, "update": update},
                network={"biases": True},
            ),
            seed=seed,
        )
        for update in ("simultaneous", "sequential")
    ]
    for name in traces[0].variables:
        assert traces[0][name].values.tobytes() == traces[1][name].values.tobytes(), name
