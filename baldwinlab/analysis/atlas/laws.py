"""Laws of the atlas: predictions without fitted parameters for each cell of a map.

A map is a grid over settings of a model. A cell is one combination of these settings. A law
predicts NaN in the cells for which it is not derived.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import inf
from typing import Final, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.atlas.outcomes import MEASURE_PREFIX
from baldwinlab.analysis.theory.adaptive_walk import mutation_supply
from baldwinlab.analysis.theory.choices import Bandit, cost_threshold, find_best_exploration
from baldwinlab.analysis.theory.moving_optimum import (
    selection_variance,
    steady_mismatch,
    variance_of_mutations,
    variance_of_segregation,
)
from baldwinlab.analysis.theory.needle import balance_of_unset

# Settings of the maps that no axis varies. A test compares these values with the files of maps.
BITS: Final = 16
BIT_MUTATION_RATE: Final = 1 / 32
BIT_TRIALS: Final = 30
PEAK_WIDTH: Final = 2.0
LIFE_STEPS: Final = 10
NOISE_OF_CHILDREN: Final = 0.3
MUTATION_SIZE: Final = 0.1
# Share of successful agents above which a population has found the needle.
MIN_SUCCESS: Final = 0.5


class Law(NamedTuple):
    """A law of a map."""

    quantity: str  # The predicted quantity, with its unit.
    measure: str  # Name of the measure of the model that the law predicts.
    # Function of the outcomes of a map. It returns the prediction for each cell.
    predict: Callable[[xr.Dataset], xr.DataArray]
    # The cells for which the law is derived, such as "cells with K = 0", or "" for all cells.
    domain: str = ""

    def describe(self) -> str:
        """Return the predicted quantity, with the cells for which the law is derived."""
        return f"{self.quantity}, in {self.domain} only" if self.domain else self.quantity

    def measured(self, data: xr.Dataset) -> xr.DataArray:
        """Return the measured quantity of each cell and run."""
        return data[MEASURE_PREFIX + self.measure]


def _vectorize(data: xr.Dataset, fields: Sequence[str], law: Callable[..., float]) -> xr.DataArray:
    """Return `law(*values)` for each combination of the values of `fields`, in this order."""
    coordinates = xr.broadcast(*(data[field] for field in fields))
    values: xr.DataArray = xr.apply_ufunc(np.vectorize(law, otypes=[float]), *coordinates)
    return values


def _predict_unset(data: xr.Dataset) -> xr.DataArray:
    """Return the share of undefined alleles ? on the needle. The period 0 means no change."""
    return _vectorize(
        data,
        ["moving_needle.cost_of_trials", "moving_needle.period"],
        lambda cost, period: balance_of_unset(cost_of_trials=cost, period=period or inf),
    ).where(_has_needle(data))


def _has_needle(data: xr.Dataset) -> xr.DataArray:
    """Return whether the populations of a cell have found the needle."""
    return data[MEASURE_PREFIX + "succeeded"].mean("run") >= MIN_SUCCESS


def _predict_bits(data: xr.Dataset) -> xr.DataArray:
    """Return the number of bits that mutation breaks and learning restores.

    The parents are at the only peak (K = 0), because a cost selects against learned bits, and
    tournaments select strongly.
    """
    n_bits = mutation_supply(BITS, BIT_MUTATION_RATE, BIT_TRIALS)
    is_derived = (
        (data["nk_climbers.k"] == 0)
        & (data["nk_climbers.cost_per_bit"] > 0)
        & (data["evolution.selection"] == "larger-tournament")
    )
    return xr.full_like(is_derived, n_bits, float).where(is_derived)


def _predict_mismatch(data: xr.Dataset, variance: Callable[[float], float]) -> xr.DataArray:
    """Return the mismatch after learning. `variance` is a function of the squared width V_L."""

    def predict(speed: float, share: float, cost: float) -> float:
        width_squared = selection_variance(PEAK_WIDTH, share, cost)
        return steady_mismatch(speed, share, PEAK_WIDTH, variance(width_squared), cost)

    prefix = "moving_optimum."
    # Only some maps vary the cost.
    costs = data.get(f"{prefix}cost", xr.DataArray(0.0))
    data = data.assign_coords({"cost": costs})
    return _vectorize(data, [f"{prefix}speed", f"{prefix}learned_share", "cost"], predict)


def _predict_learners(data: xr.Dataset) -> xr.DataArray:
    """Return 1 where learning costs less than the threshold c*, else 0."""
    prefix = "two_state_forager."
    threshold = predict_threshold(data)
    return (data[f"{prefix}cost"] < threshold).astype(float)


def predict_threshold(data: xr.Dataset) -> xr.DataArray:
    """Return the cost c* of learning for each pair of persistences, between and within lives."""
    prefix = "two_state_forager."
    fields = [f"{prefix}between_persistence", f"{prefix}within_persistence"]
    return _vectorize(data, fields, partial(cost_threshold, steps=LIFE_STEPS))


def _predict_unset_with_drift(data: xr.Dataset) -> xr.DataArray:
    """Return the share of ? on a needle that never moves, in a finite population."""
    fields = ["evolution.mutation_rate", "population.size"]
    return _vectorize(
        data,
        fields,
        lambda rate, agents: balance_of_unset(mutation_rate=rate, population=agents),
    ).where(_has_needle(data))


def _predict_explorers(data: xr.Dataset) -> xr.DataArray:
    """Return 1 where exploration pays, else 0."""
    # In the order of the fields of `Bandit`.
    prefix = "bandit_explorers."
    return _vectorize(
        data,
        [f"{prefix}lifetime_pulls", f"{prefix}uncertainty", f"{prefix}noise"],
        lambda *bandit: find_best_exploration(Bandit(*bandit)).pulls > 0,
    )


FOUND_NEEDLE: Final = "cells in which at least half of the agents succeed"
LAWS: Final[Mapping[str, Law]] = {
    "needle": Law("share of undefined alleles", "unset", _predict_unset, FOUND_NEEDLE),
    "needle-mutation": Law(
        "share of undefined alleles", "unset", _predict_unset_with_drift, FOUND_NEEDLE
    ),
    "nk": Law(
        "learned bits",
        "changed",
        _predict_bits,
        "cells with K = 0, a cost above 0 and tournament selection",
    ),
    "optimum-constant": Law(
        "distance after learning",
        "mismatch",
        partial(_predict_mismatch, variance=partial(variance_of_segregation, NOISE_OF_CHILDREN**2)),
    ),
    "optimum-mutation": Law(
        "distance after learning",
        "mismatch",
        partial(_predict_mismatch, variance=partial(variance_of_mutations, MUTATION_SIZE**2)),
    ),
    "forager": Law("share of learners", "learners", _predict_learners),
    "bandit": Law("share of agents that explore", "explores", _predict_explorers),
}
"""Laws by the name in `atlas.toml`."""
