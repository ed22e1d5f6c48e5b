"""Measures: numbers that summarize a run, for figures and for claims of papers."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

# Commands that show presets do not load xarray, which takes time.
if TYPE_CHECKING:
    import xarray as xr


class Measure(NamedTuple):
    """Number that summarizes a run, for figures and for claims of papers.

    Attributes
    ----------
    meaning : str
        Description with unit.
    of : Callable
        Function that returns an array (run) from the stored runs, a dataset (run, generation,
        agent). NaN: no value.
    censored : Callable or None
        For a duration: function that returns a bool array (run) from the stored runs. True: the
        duration is longer than the observed value.
    """

    meaning: str
    of: Callable[[xr.Dataset], xr.DataArray]
    censored: Callable[[xr.Dataset], xr.DataArray] | None = None
