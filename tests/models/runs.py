"""Runs of a model as one dataset, and their measures."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.simulation.records import make_run_dataset
from baldwinlab.simulation.simulate import simulate_histories


def simulate_runs(experiment: Any, seed: int, n_runs: int = 1) -> xr.Dataset:
    """Return the variables (run, generation, agent) of runs 0 to `n_runs` - 1."""
    histories = simulate_histories(experiment, seed, range(n_runs))
    return xr.concat([make_run_dataset(history) for history in histories], "run")


def measure_runs(experiment: Any, seed: int, n_runs: int = 1) -> dict[str, npt.NDArray[np.float64]]:
    """Return the measures of the model, by name, with a value for each run."""
    runs = simulate_runs(experiment, seed, n_runs)
    measures = experiment.model_part.all_measures()
    return {name: measure.of(runs).values for name, measure in measures.items()}
