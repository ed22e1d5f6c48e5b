"""Test that an experiment and a seed have the same results in any batch, thread and order."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from itertools import product

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
        "rule": "self-taught",
        "control": "drift",
        "evolved_rate": True,
        "teacher": "shuffled",
        "cost_per_change": 0.5,
        "steps": 50,
    },
    "motor": {"noise": 0.2},
    "evolution": {"lamarckian_share": 0.5},
    "world": {"start": {"headings": "random"}},
}

every_experiment = pytest.mark.parametrize(
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
    ]
    + [
        pytest.param(
            make_small_experiment("evo+self-taught", learning={"control": "yoked"}).replace(
                name="yoked"
            ),
            # It is another program, which takes six seconds to compile.
            marks=pytest.mark.nightly,
        )
    ],
    ids=lambda experiment: (
        f"{experiment.name}-{experiment.lifetime.update}-{experiment.population.size}"
    ),
)


def assert_bit_identical(actual: xr.Dataset, expected: xr.Dataset) -> None:
    for name in actual.variables:
        assert actual[name].values.tobytes() == expected[name].values.tobytes(), name
    assert actual.attrs == expected.attrs


@every_experiment
def test_a_run_is_bit_identical_in_every_batch(experiment: Experiment) -> None:
    single = {run: simulate(experiment, seed=9, run=run) for run in RUNS}
    assert len({result["genome"].values.tobytes() for result in single.values()}) == len(RUNS)
    assert sum(int(result["food_eaten"].sum()) for result in single.values()) > 0
    for grouping in GROUPINGS:
        for group in grouping:
            for run, result in zip(group, simulate_batch(experiment, 9, group), strict=True):
                assert_bit_identical(result, single[run])


def test_runs_on_threads_are_bit_identical() -> None:
    experiments = [
        make_small_experiment(
            "evo+self-taught", network={"hidden": [width]}, lifetime={"steps": 300}
        )
        for width in (2, 4, 10, 5)
    ]
    tasks = list(product(experiments, RUNS))
    serial = [simulate(experiment, seed=3, run=run) for experiment, run in tasks]
    with ThreadPoolExecutor(4) as pool:
        parallel = list(pool.map(lambda task: simulate(task[0], seed=3, run=task[1]), tasks))
    for actual, expected in zip(parallel, serial, strict=True):
        assert_bit_identical(actual, expected)


@pytest.mark.parametrize("condition", ["evo", "evo+self-taught", "self-taught"])
@pytest.mark.parametrize("generation", [0, 1, 2])
def test_a_replay_from_recorded_energy_is_the_replay_from_the_seed(
    condition: str, generation: int
) -> None:
    experiment = make_small_experiment(condition, evolution={"mutation_rate": 0.5})
    energy = simulate(experiment, seed=4, run=2)["energy"]
    assert energy.sum() > 0
    assert_bit_identical(
        replay(experiment, seed=4, run=2, generation=generation, energy=energy),
        replay(experiment, seed=4, run=2, generation=generation),
    )


@pytest.mark.parametrize("condition", ["evo", "evo+self-taught"])
@pytest.mark.parametrize("seed", range(5))
def test_simultaneous_and_sequential_updates_are_equal_for_a_single_agent(
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
