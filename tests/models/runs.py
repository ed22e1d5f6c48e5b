"""Runs of a model as one dataset."""

from __future__ import annotations

from typing import Any

import xarray as xr

from baldwinlab.simulation.simulate import simulate_histories


def simulate_runs(experiment: Any, seed: int, n_runs: int = 1) -> xr.Dataset:
    """Return the variables (run, generation, agent) of the runs from number 0 on."""
    histories = simulate_histories(experiment, seed, range(n_runs))
    return xr.concat([history.dataset() for history in histories], "run")
