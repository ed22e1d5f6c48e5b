"""Roulette wheel, which draws agents with a probability proportional to their shares."""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.rng_key import Parents, Uniforms
from baldwinlab.evolution.sorting import Keys


@compiled
def draw_index(count: int, uniform: float) -> Any:
    """Return a random integer below `count`."""
    return np.int64(uniform * count)


@compiled
def sum_shares(shares: Keys) -> Any:
    """Replace `shares` by cumulative sums; return the total and the last agent with a share.

    If all shares are 0, all agents have equal shares.
    """
    is_uniform = True
    for agent in range(shares.size):
        is_uniform = is_uniform and shares[agent] == 0.0
    total = 0.0
    last = 0
    for agent in range(shares.size):
        share = 1.0 if is_uniform else shares[agent]
        total += share
        shares[agent] = total
        if share > 0.0:
            last = agent
    return total, last


@compiled
def spin(uniforms: Uniforms, shares: Keys, parents: Parents) -> None:
    """Fill `parents` by the probabilities `shares`, which become cumulative sums."""
    total, _ = sum_shares(shares)
    for child in range(parents.shape[0]):
        for parent in range(2):
            parents[child, parent] = find_first_above(shares, uniforms[child, 0, parent] * total)


@compiled
def find_first_above(sums: Keys, value: float) -> Any:
    """Return the first index at which `sums`, in ascending order, is above `value`, or the last."""
    low = np.int64(0)
    high = np.int64(sums.size - 1)
    while low < high:
        middle = (low + high) // 2
        if sums[middle] > value:
            high = middle
        else:
            low = middle + 1
    return low
