"""Selection schemes in addition to those of the first paper.

References
----------
.. [1] J. E. Baker, "Reducing bias and inefficiency in the selection algorithm", Proceedings of the
   2nd International Conference on Genetic Algorithms (1987): `expected-offspring`.
.. [2] S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive
   Behavior 3 (1994): `best-copies`. In that paper, the best 20 of 100 agents have five children
   each.
.. [3] D. Floreano and J. Urzelai, "Evolutionary robots with on-line self-organization and
   behavioral fitness", Neural Networks 13 (2000): the setting `two_parent_share` of `best-copies`.
.. [4] D. E. Goldberg and K. Deb, "A comparative analysis of selection schemes used in genetic
   algorithms", Foundations of Genetic Algorithms 1 (1991): `larger-tournament`.
"""

from __future__ import annotations

from itertools import accumulate
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.rng_key import Fitness, Parents, Uniforms
from baldwinlab.evolution.selection import find_first_above
from baldwinlab.evolution.sorting import Keys, Order, sort_by
from baldwinlab.parts import Field, Selection


class ExpectedOffspring(Selection, name="expected-offspring"):
    """Roulette with low variance: an agent is a parent as often as expected, rounded up or down.

    References
    ----------
    Baker 1987 (stochastic universal sampling).
    """

    least: ClassVar[float] = 0.0

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        """Spin a wheel with one pointer per parent, at equal distances, and shuffle the parents."""
        total, last = _slices(fitness, shares)
        n_parents = 2 * parents.shape[0]
        agent = 0
        for index in range(n_parents):
            pointer = (index + uniforms[0, 1, 0]) * total / n_parents
            while agent < last and shares[agent] <= pointer:
                agent += 1
            parents[index // 2, index % 2] = agent
        for index in range(n_parents - 1, 0, -1):
            swapped = int(uniforms[index // 2, 0, index % 2] * (index + 1))
            moved = parents[swapped // 2, swapped % 2]
            parents[swapped // 2, swapped % 2] = parents[index // 2, index % 2]
            parents[index // 2, index % 2] = moved

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        slices = list(accumulate(fitness if any(fitness) else [1.0 for _ in fitness]))
        n_parents = 2 * len(uniforms)
        pointers = [
            (index + uniforms[0][1][0]) * slices[-1] / n_parents for index in range(n_parents)
        ]
        drawn = [
            next(agent for agent, end in enumerate(slices) if pointer < end) for pointer in pointers
        ]
        for index in range(n_parents - 1, 0, -1):
            swapped = int(uniforms[index // 2][0][index % 2] * (index + 1))
            drawn[index], drawn[swapped] = drawn[swapped], drawn[index]
        return [drawn[index : index + 2] for index in range(0, n_parents, 2)]


class BestCopies(Selection, name="best-copies"):
    """The best agents, with the same number of children each and one parent per child.

    If the number is not even, the fittest agents have one child more.
    The share `two_parent_share` of the children has a second parent among the best.

    References
    ----------
    Nolfi, Elman and Parisi 1994; Floreano and Urzelai 2000.
    """

    parent_share: float = Field(
        0.2,
        gt=0,
        le=1,
        description="Share of the fittest agents that have children; at least one agent.",
    )
    two_parent_share: float = Field(
        0.0,
        ge=0,
        le=1,
        description="Share of the children with a second parent among the fittest.",
    )

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        best = max(1, int(part.parent_share * fitness.size + 0.5))
        for agent in range(fitness.size):
            shares[agent] = -fitness[agent]
        # Equal agents are in random order.
        sort_by(shares, uniforms[:, 1, 0], order)
        for child in range(parents.shape[0]):
            parents[child, 0] = parents[child, 1] = order[child % best]
            if uniforms[child, 0, 0] < part.two_parent_share:
                parents[child, 1] = order[int(uniforms[child, 0, 1] * best)]

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        order = sorted(
            range(len(fitness)), key=lambda agent: (-fitness[agent], uniforms[agent][1][0])
        )
        best = order[: max(1, int(part.parent_share * len(fitness) + 0.5))]
        pairs = [[best[child % len(best)]] * 2 for child in range(len(uniforms))]
        for pair, (draws, _) in zip(pairs, uniforms, strict=True):
            if draws[0] < part.two_parent_share:
                pair[1] = best[int(draws[1] * len(best))]
        return pairs


class Outcrossing(Selection, name="outcrossing"):
    """Roulette in which the second parent is another agent than the first.

    References
    ----------
    Hinton and Nowlan 1987.
    """

    least: ClassVar[float] = 0.0

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        total, _ = _slices(fitness, shares)
        for child in range(parents.shape[0]):
            first = find_first_above(shares, uniforms[child, 0, 0] * total)
            before = shares[first - 1] if first > 0 else 0.0
            rest = before + (total - shares[first])
            if rest > 0.0:
                pointer = uniforms[child, 0, 1] * rest
                second = find_first_above(
                    shares, pointer if pointer < before else shares[first] + (pointer - before)
                )
            elif fitness.size > 1:
                # No other agent has any fitness.
                second = np.int64(uniforms[child, 0, 1] * (fitness.size - 1))
                second += np.int64(second >= first)
            else:
                second = first
            parents[child, 0] = first
            parents[child, 1] = second

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        def drawn(shares: Any, draw: float) -> int:
            slices = list(accumulate(shares))
            return next(agent for agent, end in enumerate(slices) if draw * slices[-1] < end)

        shares = list(fitness) if any(fitness) else [1.0 for _ in fitness]
        pairs = []
        for first_draw, second_draw, *_ in (draws[0] for draws in uniforms):
            first = drawn(shares, first_draw)
            other_shares = [share * (agent != first) for agent, share in enumerate(shares)]
            alike = [float(agent != first or len(shares) == 1) for agent in range(len(shares))]
            pairs.append([first, drawn(other_shares if any(other_shares) else alike, second_draw)])
        return pairs


class LargerTournament(Selection, name="larger-tournament"):
    """The fittest of `size` randomly drawn agents. Of equal agents, the one drawn first.

    References
    ----------
    Goldberg and Deb 1991.
    """

    size: int = Field(3, ge=2, le=4, description="Number of agents drawn for each parent.")

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        for child in range(parents.shape[0]):
            for parent in range(2):
                best = int(uniforms[child, parent, 0] * fitness.size)
                for draw in range(1, part.size):
                    agent = int(uniforms[child, parent, draw] * fitness.size)
                    best = agent if fitness[agent] > fitness[best] else best
                parents[child, parent] = best

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        tournaments = [
            [[int(draw * len(fitness)) for draw in draws[: part.size]] for draws in of_child[:2]]
            for of_child in uniforms
        ]
        return [
            [max(agents, key=lambda agent: fitness[agent]) for agents in of_child]
            for of_child in tournaments
        ]


@compiled
def _slices(fitness: Fitness, shares: Keys) -> Any:
    """Fill `shares` with the cumulative fitness. Return its end and the last agent with a share.

    If no agent has any fitness, all agents have equal shares.
    """
    all_zero = True
    for agent in range(fitness.size):
        all_zero = all_zero and fitness[agent] == 0.0
    total, last = 0.0, 0
    for agent in range(fitness.size):
        total += 1.0 if all_zero else fitness[agent]
        shares[agent] = total
        if all_zero or fitness[agent] > 0.0:
            last = agent
    return total, last
