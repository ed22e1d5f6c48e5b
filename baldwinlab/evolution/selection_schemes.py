"""Selection schemes beside those of the first paper.

References
----------
.. [1] J. E. Baker, "Reducing bias and inefficiency in the selection algorithm", Proceedings of the
   2nd International Conference on Genetic Algorithms (1987): `expected-offspring`.
.. [2] S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive
   Behavior 3 (1994): `best-copies`. In that paper the best 20 of 100 agents have five children each.
.. [3] D. Floreano and J. Urzelai, "Evolutionary robots with on-line self-organization and behavioral
   fitness", Neural Networks 13 (2000): the setting `two_parent_share` of `best-copies`.
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
        """One spin of a wheel with as many pointers, evenly spaced, as there are places for parents; then these are shuffled."""
        total, last = _slices(fitness, shares)
        places, agent = 2 * parents.shape[0], 0
        for place in range(places):
            pointer = (place + uniforms[0, 1, 0]) * total / places
            while agent < last and shares[agent] <= pointer:
                agent += 1
            parents[place // 2, place % 2] = agent
        for place in range(places - 1, 0, -1):
            other = int(uniforms[place // 2, 0, place % 2] * (place + 1))
            moved = parents[other // 2, other % 2]
            parents[other // 2, other % 2] = parents[place // 2, place % 2]
            parents[place // 2, place % 2] = moved

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        slices = list(accumulate(fitness if any(fitness) else [1.0 for _ in fitness]))
        places = 2 * len(uniforms)
        pointers = [(place + uniforms[0][1][0]) * slices[-1] / places for place in range(places)]
        drawn = [
            next(agent for agent, end in enumerate(slices) if pointer < end) for pointer in pointers
        ]
        for place in range(places - 1, 0, -1):
            other = int(uniforms[place // 2][0][place % 2] * (place + 1))
            drawn[place], drawn[other] = drawn[other], drawn[place]
        return [drawn[place : place + 2] for place in range(0, places, 2)]


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
        sort_by(shares, uniforms[:, 1, 0], order)  # equals in random order
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
            others = before + (total - shares[first])
            if others > 0.0:
                pointer = uniforms[child, 0, 1] * others
                second = find_first_above(
                    shares, pointer if pointer < before else shares[first] + (pointer - before)
                )
            elif fitness.size > 1:  # nobody else has any fitness
                second = np.int64(uniforms[child, 0, 1] * (fitness.size - 1))
                second += np.int64(second >= first)
            else:
                second = first
            parents[child, 0], parents[child, 1] = first, second

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        def drawn(shares: Any, draw: float) -> int:
            slices = list(accumulate(shares))
            return next(agent for agent, end in enumerate(slices) if draw * slices[-1] < end)

        shares, pairs = list(fitness) if any(fitness) else [1.0 for _ in fitness], []
        for one, two, *_ in (draws[0] for draws in uniforms):
            first = drawn(shares, one)
            others = [share * (agent != first) for agent, share in enumerate(shares)]
            alike = [float(agent != first or len(shares) == 1) for agent in range(len(shares))]
            pairs.append([first, drawn(others if any(others) else alike, two)])
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
        fought = [
            [[int(draw * len(fitness)) for draw in draws[: part.size]] for draws in of_child[:2]]
            for of_child in uniforms
        ]
        return [
            [max(each, key=lambda agent: fitness[agent]) for each in of_child]
            for of_child in fought
        ]


@compiled
def _slices(fitness: Fitness, shares: Keys) -> Any:
    """Fill `shares` with fitness added up, alike for all if nobody has any. Gives where it ends, and who has the last slice."""
    nobody = True
    for agent in range(fitness.size):
        nobody = nobody and fitness[agent] == 0.0
    total, last = 0.0, 0
    for agent in range(fitness.size):
        total += 1.0 if nobody else fitness[agent]
        shares[agent] = total
        if nobody or fitness[agent] > 0.0:
            last = agent
    return total, last
