"""Functions of runs for measures of several models: means of a record over agents."""

from __future__ import annotations

from collections.abc import Callable

from baldwinlab.core.deferred import xr


def mean_of_last_generation(record: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return a function of runs: the mean of a record in the last generation."""
    return lambda runs: runs[record].isel(generation=-1).mean("agent")
