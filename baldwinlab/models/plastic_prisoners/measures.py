"""Numbers of agents per strategy, and measures that depend on them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.engine.jit import jit_entry_point
from baldwinlab.models.plastic_prisoners.strategies import OUTSTANDING, STRATEGIES


@jit_entry_point
def count_agents(strategies: Any, counts: Any) -> None:
    """Add the numbers of agents per strategy to `counts` [generation, strategy].

    `strategies` [generation, agent] is NaN for missing agents, which are not counted.
    """
    for generation in range(strategies.shape[0]):
        for agent in range(strategies.shape[1]):
            if strategies[generation, agent] >= 0:
                counts[generation, int(strategies[generation, agent])] += 1


def count_strategies(runs: xr.Dataset) -> xr.DataArray:
    """Return the number of agents with each strategy, as (..., generation, strategy)."""
    strategies = runs["strategy"].transpose(..., "agent")
    counts = np.zeros((strategies.size // strategies.sizes["agent"], len(STRATEGIES)), np.int64)
    count_agents(strategies.values.reshape(len(counts), -1), counts)
    template = strategies.isel(agent=0, drop=True).expand_dims(strategy=list(STRATEGIES), axis=-1)
    return template.copy(data=counts.reshape(template.shape))


def share_of_plastic_entries(runs: xr.Dataset) -> xr.DataArray:
    """Return the share of plastic entries by generation, or NaN without agents."""
    counts = count_strategies(runs)
    plastic_shares = xr.DataArray(
        [strategy.count("x") / 4 for strategy in STRATEGIES], dims="strategy"
    )
    return (counts * plastic_shares).sum("strategy") / counts.sum("strategy")


def fall_of_plasticity(runs: xr.Dataset) -> xr.DataArray:
    """Return the mean share of plastic entries from generation 150 to 500 minus that from 1801 on.

    The value is 0 for a run that ends before generation 150.
    """
    shares = share_of_plastic_entries(runs)
    last = shares.sizes["generation"] - 1
    early = shares.isel(generation=slice(min(150, last), 501))
    late = shares.isel(generation=slice(min(1801, last), None))
    return early.mean("generation") - late.mean("generation")


def share_of_outstanding(runs: xr.Dataset) -> xr.DataArray:
    """Return the share of agents with [x00x] by generation, or NaN without agents."""
    counts = count_strategies(runs)
    return counts.sel(strategy=OUTSTANDING) / counts.sum("strategy")


def value_at_generation(
    quantity: Callable[[xr.Dataset], xr.DataArray], generation: int
) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return a function of runs: a quantity in a generation.

    In shorter runs, it is the quantity in the last generation.
    """

    def measure(runs: xr.Dataset) -> xr.DataArray:
        index = min(generation, runs.sizes["generation"] - 1)
        return quantity(runs.isel(generation=[index])).isel(generation=0)

    return measure


def is_outstanding_leading(runs: xr.Dataset) -> xr.DataArray:
    """Return 1 if [x00x] is the most frequent strategy, else 0."""
    return (count_strategies(runs).idxmax("strategy") == OUTSTANDING).astype(float)


def compare_with_rival(runs: xr.Dataset) -> xr.DataArray:
    """Return 1 if [x00x] is the most frequent strategy, -1 if its main rival is, else 0.

    The main rival is the strategy that leads in the largest number of runs in which [x00x] does
    not.
    """
    leading = count_strategies(runs).idxmax("strategy")
    competitors = leading.values[leading.values != OUTSTANDING]
    rivals, n_runs = np.unique(competitors, return_counts=True)
    main_rival = rivals[n_runs.argmax()] if rivals.size else ""
    return (leading == OUTSTANDING).astype(float) - (leading == main_rival)
