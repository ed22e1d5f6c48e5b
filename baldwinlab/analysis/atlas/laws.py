"""Laws of the maps: predictions without fitted parameters, at each cell of a map."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import inf
from typing import Final, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.atlas.outcomes import MEASURE_PREFIX
from baldwinlab.analysis.theory.needle import balance_of_unset


class Law(NamedTuple):
    """A law of a map.

    Attributes
    ----------
    quantity : str
        The predicted quantity, with its unit.
    measure : str
        Measure of the model that the law predicts.
    predict : callable
        Function of the outcomes of a map. It returns the prediction at each cell.
    """

    quantity: str
    measure: str
    predict: Callable[[xr.Dataset], xr.DataArray]

    def measured(self, data: xr.Dataset) -> xr.DataArray:
        """Return the measured quantity of each cell and run."""
        return data[MEASURE_PREFIX + self.measure]


def _vectorize(data: xr.Dataset, fields: Sequence[str], law: Callable[..., float]) -> xr.DataArray:
    """Return `law` at each combination of the values of some fields."""
    coordinates = xr.broadcast(*(data[field] for field in fields))
    values: xr.DataArray = xr.apply_ufunc(np.vectorize(law, otypes=[float]), *coordinates)
    return values


def _predict_unset(data: xr.Dataset) -> xr.DataArray:
    """Return the share of ? on the needle, in a population of 1,000 agents."""
    return _vectorize(
        data,
        ["moving_needle.cost_of_trials", "moving_needle.period"],
        lambda cost, period: balance_of_unset(
            cost_of_trials=cost, period=period or inf, population=1000
        ),
    )


LAWS: Final[Mapping[str, Law]] = {
    "needle": Law("share of undefined alleles", "unset", _predict_unset),
}
"""Laws by the name in `atlas.toml`."""
