"""Functions of runs for measures of several models: means of a record over agents.

`dtype` is the type of the values before the mean. Without it, a mean has the type of the record.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from baldwinlab.core.deferred import xr

Average = Callable[["xr.Dataset"], "xr.DataArray"]


def mean_at(record: str, generation: int, dtype: type[np.floating] | None = None) -> Average:
    """Return a function of runs: the mean of a record in a generation.

    In shorter runs, and for the generation -1, it is the mean in the last generation.
    """

    def average(runs: xr.Dataset) -> xr.DataArray:
        last_generation = runs.sizes["generation"] - 1
        values = runs[record].isel(generation=min(generation, last_generation))
        return _convert(values, dtype).mean("agent")

    return average


def mean_of_last_generation(record: str) -> Average:
    """Return a function of runs: the mean of a record in the last generation."""
    return mean_at(record, -1)


def mean_of_second_half(record: str, dtype: type[np.floating] | None = None) -> Average:
    """Return a function of runs: the mean of a record over the second half of the generations."""

    def average(runs: xr.Dataset) -> xr.DataArray:
        second_half = slice(runs.sizes["generation"] // 2, None)
        values = runs[record].isel(generation=second_half)
        return _convert(values, dtype).mean(("generation", "agent"))

    return average


def change_of_mean(record: str, start: int, end: int) -> Average:
    """Return a function of runs: the change of the float64 mean between two generations."""
    return lambda runs: (
        mean_at(record, end, np.float64)(runs) - mean_at(record, start, np.float64)(runs)
    )


def _convert(values: xr.DataArray, dtype: type[np.floating] | None) -> xr.DataArray:
    return values if dtype is None else values.astype(dtype)
