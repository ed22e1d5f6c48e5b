"""Selection schemes with a probability proportional to fitness, or equal for all agents.

A roulette wheel draws agents. The *share* of an agent is a number of at least 0, to which the
probability of the agent is proportional.

References
----------
.. [1] Le 2019: `roulette`.
.. [2] J. E. Baker, "Reducing bias and inefficiency in the selection algorithm", Proceedings of the
   2nd International Conference on Genetic Algorithms (1987): `expected-offspring`.
.. [3] G. E. Hinton and S. J. Nowlan, "How learning can guide evolution", Complex Systems 1 (1987):
   `outcrossing`.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.rng_key import Parents, Uniforms
from baldwinlab.evolution.selection import Keys
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts import Generation, Selection
from baldwinlab.parts.selection import mark_fittest


@compiled
def draw_index(count: int, uniform: float) -> Any:
    """Return the integer from 0 to `count` - 1 that a random number in (0, 1) selects."""
    return np.int64(uniform * count)


@compiled
def sum_shares(shares: Keys) -> Any:
    """Replace `shares` by cumulative sums. Return (total, last agent with a share above 0).

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
    """Draw all `parents` by a roulette wheel. `shares` [agent] become cumulative sums."""
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


class Roulette(Selection, name="roulette"):
    """Probability proportional to fitness, which must not be negative.

    If the fitness of all agents is 0, all have the same probability.

    References
    ----------
    Le 2019.
    """

    minimum_fitness: ClassVar[float] = 0.0

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        for agent in range(generation.fitness.size):
            generation.shares[agent] = generation.fitness[agent]
        spin(generation.uniforms, generation.shares, generation.parents)


class ExpectedOffspring(Selection, name="expected-offspring"):
    """Roulette with low variance: an agent is a parent the expected number of times, rounded.

    References
    ----------
    Baker 1987 (stochastic universal sampling).
    """

    minimum_fitness: ClassVar[float] = 0.0

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        """Spin a wheel with one pointer per parent, at equal distances, and shuffle the parents."""
        parents = generation.parents
        for agent in range(generation.fitness.size):
            generation.shares[agent] = generation.fitness[agent]
        total, last = sum_shares(generation.shares)
        n_parents = 2 * parents.shape[0]
        agent = 0
        for index in range(n_parents):
            # All pointers are moved by the same random number.
            pointer = (index + generation.uniforms[0, 1, 0]) * total / n_parents
            while agent < last and generation.shares[agent] <= pointer:
                agent += 1
            # Parent `index` is column index % 2 of child index // 2.
            parents[index // 2, index % 2] = agent
        # Fisher-Yates shuffle: parent `index` and a random one of the parents 0 to `index` swap.
        for index in range(n_parents - 1, 0, -1):
            swap_index = int(generation.uniforms[index // 2, 0, index % 2] * (index + 1))
            swapped_parent = parents[swap_index // 2, swap_index % 2]
            parents[swap_index // 2, swap_index % 2] = parents[index // 2, index % 2]
            parents[index // 2, index % 2] = swapped_parent


class Outcrossing(Selection, name="outcrossing"):
    """Roulette in which the two parents of a child are different agents.

    References
    ----------
    Hinton and Nowlan 1987.
    """

    minimum_fitness: ClassVar[float] = 0.0

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        fitness = generation.fitness
        shares = generation.shares
        parents = generation.parents
        for agent in range(fitness.size):
            shares[agent] = fitness[agent]
        total, _ = sum_shares(shares)
        for child in range(parents.shape[0]):
            first = find_first_above(shares, generation.uniforms[child, 0, 0] * total)
            share_before = shares[first - 1] if first > 0 else 0.0
            share_of_others = share_before + (total - shares[first])
            if share_of_others > 0.0:
                pointer = generation.uniforms[child, 0, 1] * share_of_others
                # The pointer skips the share of the first parent.
                if pointer >= share_before:
                    pointer = shares[first] + (pointer - share_before)
                second = find_first_above(shares, pointer)
            elif fitness.size > 1:
                # All other agents have the fitness 0, so all have the same probability.
                second = np.int64(generation.uniforms[child, 0, 1] * (fitness.size - 1))
                # The random index counts all agents but the first parent.
                second += np.int64(second >= first)
            else:
                second = first
            parents[child, 0] = first
            parents[child, 1] = second


class Neutral(Selection, name="neutral"):
    """A random agent, independent of fitness: the neutral control."""

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        for child in range(generation.parents.shape[0]):
            for parent in range(2):
                draw = generation.uniforms[child, 0, parent]
                generation.parents[child, parent] = draw_index(generation.fitness.size, draw)

    @staticmethod
    def mark_survivors(part: Any, generation: Generation, count: int) -> None:
        # Random numbers replace fitness and break ties, so that survivors are random, too.
        draws = generation.uniforms[:, 1, 3]
        mark_fittest(count, draws, draws, generation.parents)


def is_neutral_control(part: Any, experiment: BaseExperiment) -> bool:
    """Return whether fitness has no effect on selection, for `derived` of a part."""
    return experiment.evolution.selection == Neutral.name
