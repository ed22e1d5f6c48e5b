"""Heapsort of agents in compiled code, without allocation and with a defined order of ties."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled

Keys = npt.NDArray[np.float64]  # [agent]
Order = npt.NDArray[np.int64]  # [rank], an agent


@compiled
def sort_by(keys: Keys, ties: Keys, order: Order) -> None:
    """Fill `order` with agents in ascending order of `keys`, then of `ties`, then of their index.

    References
    ----------
    .. [1] J. W. J. Williams, "Algorithm 232: Heapsort", Communications of the ACM 7 (1964).
    """
    for agent in range(order.size):
        order[agent] = agent
    for root in range(order.size // 2 - 1, -1, -1):
        _sift_down(keys, ties, order, root, order.size)
    for end in range(order.size - 1, 0, -1):
        order[0], order[end] = order[end], order[0]
        _sift_down(keys, ties, order, 0, end)


@compiled
def _sift_down(keys: Keys, ties: Keys, order: Order, root: Any, end: int) -> None:
    """Move the agent at `root` down the heap until both of its children come before it."""
    while 2 * root + 1 < end:
        child = 2 * root + 1
        if child + 1 < end and _comes_before(keys, ties, order[child], order[child + 1]):
            child += 1
        if not _comes_before(keys, ties, order[root], order[child]):
            return
        order[root], order[child] = order[child], order[root]
        root = child


@compiled
def _comes_before(keys: Keys, ties: Keys, a: Any, b: Any) -> bool:
    if keys[a] != keys[b]:
        return bool(keys[a] < keys[b])
    if ties[a] != ties[b]:
        return bool(ties[a] < ties[b])
    return bool(a < b)
