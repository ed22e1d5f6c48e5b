"""Heapsort of agents in compiled code, without allocation and with a defined order of ties."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled

# [agent].
Keys = npt.NDArray[np.float64]
# [rank]: the agent with this rank.
Order = npt.NDArray[np.int64]


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
def sort_from_fittest(fitness: Keys, ties: Keys, keys: Keys, order: Order) -> None:
    """Fill `order` with agents from the fittest on. `keys` [agent] is scratch."""
    for agent in range(fitness.size):
        keys[agent] = -fitness[agent]
    sort_by(keys, ties, order)


@compiled
def _sift_down(keys: Keys, ties: Keys, order: Order, root: Any, end: int) -> None:
    """Move the agent at `root` down the heap until both of its children come before it."""
    # The children of an agent in the heap are at the indices 2 * root + 1 and 2 * root + 2.
    while 2 * root + 1 < end:
        child = 2 * root + 1
        if child + 1 < end and _comes_before(keys, ties, order[child], order[child + 1]):
            child += 1
        if not _comes_before(keys, ties, order[root], order[child]):
            return
        order[root], order[child] = order[child], order[root]
        root = child


@compiled
def _comes_before(keys: Keys, ties: Keys, first: Any, second: Any) -> bool:
    """Return whether agent `first` comes before agent `second` in the order of `sort_by`."""
    if keys[first] != keys[second]:
        return bool(keys[first] < keys[second])
    if ties[first] != ties[second]:
        return bool(ties[first] < ties[second])
    return bool(first < second)
