"""Choice of the best value of a setting for each condition, from the runs of the tuning."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from baldwinlab.analysis.statistics import fitness

LAST_GENERATIONS = 10
"""Number of final generations over which a run is averaged."""


def measure_medians(data: xr.Dataset) -> dict[str, float]:
    """Compute the median over runs of the mean fitness in the last generations.

    `data`: the runs with one value of the setting, (condition, run, generation, agent).
    """
    medians = fitness.final(data, "mean", LAST_GENERATIONS).median("run")
    return {str(name): float(medians.sel(condition=name)) for name in data["condition"].values}


def choose_values(medians: Mapping[float, Mapping[str, float]]) -> dict[str, float]:
    """Choose the value with the largest median for each condition."""
    values = sorted(medians)
    conditions = list(medians[values[0]])
    return {
        name: values[int(np.argmax([medians[value][name] for value in values]))]
        for name in conditions
    }
