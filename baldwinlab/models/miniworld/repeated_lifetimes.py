"""Results of agents with several lifetimes (`lifetime.repeats`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from baldwinlab.parts.model_part import LifeResults


def combine_lifetimes(lifetimes: Sequence[LifeResults]) -> LifeResults:
    """Return the means of the results of several lifetimes of the same agents.

    The eaten items of each region are those of all lifetimes. The learned weights and the final
    positions are those of the first lifetime. A single lifetime is returned unchanged.
    """
    first_lifetime = lifetimes[0]
    if len(lifetimes) == 1:
        return first_lifetime
    records: dict[str, Any] = {
        name: np.mean([results.records[name] for results in lifetimes], axis=0, dtype=np.float64)
        for name in first_lifetime.records
    }
    eaten = [results.eaten for results in lifetimes if results.eaten is not None]
    return first_lifetime._replace(
        eaten=np.sum(eaten, axis=0, dtype=np.int32),
        energy=np.mean([results.energy for results in lifetimes], axis=0),
        cost=np.mean([results.cost for results in lifetimes], axis=0),
        records=records,
        lifetimes=tuple(lifetimes),
    )
