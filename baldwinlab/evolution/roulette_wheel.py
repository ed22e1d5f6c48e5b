"""Roulette wheel: draw agents with probability proportional to their shares."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
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
    """Draw `parents` with probability proportional to `shares`, as `sum_shares` changes them."""
    total, _ = sum_shares(shares)
    for child in range(parents.shape[0]):
        for parent in range(2):
            parents[child, parent] = find_first_above(shares, uniforms[child, 0, parent] * total)


@compiled
def find_first_above(sums: Keys, value: float) -> Any:
    """Return the first index of ascending `sums` with more than `value`, or the last index."""
    low = np.int64(0)
    high = np.int64(sums.size - 1)
    while low < high:
        middle = (low + high) // 2
        if sums[middle] > value:
            high = middle
        else:
            low = middle + 1
    return low


def sum_shares_oracle(shares: Sequence[float]) -> list[float]:
    """Return the cumulative shares, which are equal if all are 0."""
    return list(accumulate(shares if any(shares) else [1.0 for _ in shares]))


def spin_oracle(shares: Any, uniforms: Any) -> list[list[int]]:
    """Return the parents that a roulette wheel selects."""
    sums = sum_shares_oracle(shares)

    def drawn(draw: float) -> int:
        return next(agent for agent, end in enumerate(sums) if draw * sums[-1] < end)

    return [[drawn(draw) for draw in draws[0][:2]] for draws in uniforms]
