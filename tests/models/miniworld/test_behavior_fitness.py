"""Fitness by distance and by the time of eating equals a calculation from the trace of a life."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.experiment import Experiment
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

STEPS = 60


def make_experiment(fitness: str, **changes: Any) -> Experiment:
    """Return an experiment with an early-weighted or distance fitness on a small map."""
    return make_small_experiment(
        "evo", evolution={"fitness": fitness}, lifetime={"steps": STEPS}
    ).replace(**changes)


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
    experiment = make_experiment("distance")
    experiment = experiment.replace(evolution={"distance": {"measure": measure}})
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
    experiment = make_experiment("early-food")
    run = simulate(experiment, seed=3)
    trace = trace_one_more_step(experiment, 0).isel(step=slice(STEPS))
    remaining = (STEPS - np.arange(STEPS)) / STEPS
    expected = (trace.eaten.values * remaining[:, None]).sum(axis=0)
    assert expected.max() > 0
    np.testing.assert_allclose(run.energy.values[0], expected, rtol=1e-5, atol=1e-5)
