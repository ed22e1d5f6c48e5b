"""Fitness by distance and by the time of eating agrees with a trace, and novelty with theory."""

from __future__ import annotations

from math import gamma, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import load
from baldwinlab.parts.lifetimes import Lifetimes, make_lifetimes
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate, simulate_batch
from tests.evolution.single_runs import fitness
from tests.worlds import make_small_experiment

STEPS = 60


def make_experiment(**evolution: Any) -> Experiment:
    return make_small_experiment("evo", evolution=evolution, lifetime={"steps": STEPS})


def trace_one_more_step(experiment: Experiment, generation: int) -> xr.Dataset:
    """Return a trace that includes the position after the last step of a life."""
    longer = experiment.replace(lifetime={"steps": STEPS + 1}, evolution={"fitness": "energy"})
    run = simulate(experiment, seed=3)
    return replay(longer, seed=3, generation=generation, energy=run.energy)


def wrap(difference: npt.NDArray[Any], span: float) -> npt.NDArray[Any]:
    """Return the shortest differences on the torus."""
    return (difference + span / 2) % span - span / 2


@pytest.mark.nightly
@pytest.mark.parametrize("measure", ["path", "displacement"])
def test_the_distance_is_that_of_the_positions_after_each_step(measure: str) -> None:
    experiment = make_experiment(fitness="distance", distance={"measure": measure})
    run = simulate(experiment, seed=3)
    for generation in (0, 1):
        trace = trace_one_more_step(experiment, generation)
        # Positions are recorded before a step, so the second one is that after the first step.
        dx = wrap(np.diff(trace.x.values[1:], axis=0), experiment.world.width)
        dy = wrap(np.diff(trace.y.values[1:], axis=0), experiment.world.height)
        path = np.hypot(dx, dy).sum(axis=0)
        displacement = np.hypot(dx.sum(axis=0), dy.sum(axis=0))
        expected = path if measure == "path" else displacement
        np.testing.assert_allclose(run.energy.values[generation], expected, rtol=1e-4, atol=1e-3)
        np.testing.assert_allclose(run.path_length.values[generation], path, rtol=1e-4, atol=1e-3)
    assert run.energy.values.max() > 0
    assert run.path_length.attrs["units"] == "units of length"


def test_an_item_counts_by_the_share_of_life_that_remains() -> None:
    experiment = make_experiment(fitness="early-food")
    run = simulate(experiment, seed=3)
    trace = trace_one_more_step(experiment, 0).isel(step=slice(STEPS))
    remaining = (STEPS - np.arange(STEPS)) / STEPS
    expected = (trace.eaten.values * remaining[:, None]).sum(axis=0)
    assert expected.max() > 0
    np.testing.assert_allclose(run.energy.values[0], expected, rtol=1e-5, atol=1e-5)


# Size of the map of `make_small_experiment`.
WIDTH = 120.0
HEIGHT = 100.0


def make_novelty_experiment(**settings: Any) -> Experiment:
    return make_small_experiment(
        "evo", evolution={"fitness": "novelty", "selection": "tournament", "novelty": settings}
    )


def at_positions(positions: npt.NDArray[Any]) -> Lifetimes:
    return make_lifetimes(
        np.zeros((len(positions), 1, 1), np.float32), position=np.asarray(positions, np.float32)
    )


def test_the_novelty_of_random_positions_is_the_expected_distance_of_neighbors() -> None:
    """The k-th of n uniform neighbors has a known expected distance.

    Source: P. J. Clark and F. C. Evans, "Distance to nearest neighbor as a measure of spatial
    relationships in populations", Ecology 35 (1954); P. Hertz (1909) for k above 1.
    """
    n_agents = 1500
    k = 5
    positions = np.random.default_rng(7).random((n_agents, 2)) * [WIDTH, HEIGHT]
    density = (n_agents - 1) / (WIDTH * HEIGHT)
    expected = [gamma(i + 0.5) / gamma(i) / sqrt(pi * density) for i in range(1, k + 1)]
    novelty = fitness(make_novelty_experiment(neighbors=k), at_positions(positions))
    assert novelty.mean() == pytest.approx(np.mean(expected), rel=0.03)


def test_distances_are_those_of_the_torus() -> None:
    novelty = fitness(
        make_novelty_experiment(neighbors=1), at_positions(np.array([[50, 1], [50, 98]]))
    )
    np.testing.assert_allclose(novelty, 3, rtol=1e-6)


def test_a_single_agent_has_no_novelty_before_the_archive_has_positions() -> None:
    assert fitness(make_novelty_experiment(), at_positions(np.array([[1, 1]]))).tolist() == [0]


def test_positions_above_the_threshold_join_the_archive_and_replace_the_oldest() -> None:
    experiment = make_novelty_experiment(neighbors=1, archive_threshold=5, archive_size=2)
    run_arrays: dict[str, npt.NDArray[Any]] = {}
    far = at_positions(np.array([[10, 10], [30, 10]]))
    near = at_positions(np.array([[50, 50], [51, 50]]))
    np.testing.assert_allclose(fitness(experiment, far, run_arrays), 20)
    archive = run_arrays["fitness.novelty.archive"]
    assert archive.T.tolist() == [[10, 10], [30, 10]]
    # The archive has the same positions, so they are not new.
    np.testing.assert_allclose(fitness(experiment, far, run_arrays), 0)
    fitness(experiment, near, run_arrays)
    assert archive.T.tolist() == [[10, 10], [30, 10]], "the novelty is below the threshold"
    fitness(experiment, at_positions(np.array([[80, 80], [80, 60]])), run_arrays)
    assert archive.T.tolist() == [[80, 80], [80, 60]]


def test_an_extended_run_has_the_archive_of_a_long_run(tmp_path: Path) -> None:
    experiment = make_novelty_experiment(archive_threshold=1)
    long, short = (
        bl.run(
            experiment.replace(evolution={"generations": generations}),
            runs=1,
            seed=4,
            out=tmp_path / f"generations-{generations}",
        )
        for generations in (4, 2)
    )
    short.extend(generations=4)
    for name in ("energy", "parents"):
        np.testing.assert_array_equal(short.data()[name], long.data()[name])


def test_novelty_search_spreads_the_final_positions() -> None:
    """With selection for novelty, agents die farther from each other than without selection."""
    experiment = load("evo/A").replace(
        lifetime={"steps": 200},
        evolution={"generations": 12, "fitness": "novelty", "selection": "truncation"},
    )
    neutral = experiment.replace(evolution={"selection": "neutral"})
    novelty, control = (
        np.mean([run.energy.values[6:].mean() for run in simulate_batch(case, 5, [0, 1, 2, 3])])
        for case in (experiment, neutral)
    )
    assert novelty > control
