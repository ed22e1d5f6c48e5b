"""Test for conditions that evolve and learn."""

from __future__ import annotations

import xarray as xr

from baldwinlab.experiment import BaseExperiment, Experiment


def evolves_and_learns(experiment: BaseExperiment, innate: xr.Dataset | None) -> bool:
    """Return whether a condition evolves and learns.

    A model other than MiniWorld may not be loaded. Then the stored assay `innate` shows whether the
    condition learns.
    """
    if experiment.evolution.inheritance == "none":
        return False
    if isinstance(experiment, Experiment):
        return experiment.learns
    return innate is not None and bool(innate["energy"].sel(life="on").notnull().any())
