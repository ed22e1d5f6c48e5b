"""Selection schemes that depend on the order of the agents by fitness, not on the values.

References
----------
.. [1] D. E. Goldberg and K. Deb, "A comparative analysis of selection schemes used in genetic
   algorithms", Foundations of Genetic Algorithms 1 (1991): `tournament`, `larger-tournament`.
.. [2] S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive
   Behavior 3 (1994): `best-copies`. In that paper, the best 20 of 100 agents have five children
   each.
.. [3] D. Floreano and J. Urzelai, "Evolutionary robots with on-line self-organization and
   behavioral fitness", Neural Networks 13 (2000): the setting `two_parent_share` of `best-copies`.
.. [4] J. E. Baker, "Adaptive selection methods for genetic algorithms", Proceedings of the 1st
   International Conference on Genetic Algorithms (1985): `rank`.
.. [5] H.-P. Schwefel, "Numerical optimization of computer models", Wiley (1981): `mu-plus-lambda`.
.. [6] H.-G. Beyer and H.-P. Schwefel, "Evolution strategies: a comprehensive introduction", Natural
   Computing 1 (2002): `mu-plus-lambda`.
"""

from __future__ import annotations

from typing import Any

from baldwinlab.evolution.proportional_selection import draw_index, spin
from baldwinlab.evolution.selection import sort_by, sort_from_fittest
from baldwinlab.parts import Field, Generation, Selection
from baldwinlab.parts.breeding import ITSELF


class Tournament(Selection, name="tournament"):
    """The fitter of two randomly drawn agents.

    References
    ----------
    Goldberg and Deb 1991.
    """

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        fitness = generation.fitness
        for child in range(generation.parents.shape[0]):
            for parent in range(2):
                first = draw_index(fitness.size, generation.uniforms[child, 0, 2 * parent])
                second = draw_index(fitness.size, generation.uniforms[child, 0, 2 * parent + 1])
                generation.parents[child, parent] = (
                    second if fitness[second] > fitness[first] else first
                )


class LargerTournament(Selection, name="larger-tournament"):
    """The fittest of `size` randomly drawn agents. Of equal agents, the first drawn is chosen.

    References
    ----------
    Goldberg and Deb 1991.
    """

    size: int = Field(3, ge=2, le=4, description="Number of agents drawn for each parent.")

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        fitness = generation.fitness
        for child in range(generation.parents.shape[0]):
            for parent in range(2):
                best = int(generation.uniforms[child, parent, 0] * fitness.size)
                for draw in range(1, part.size):
                    agent = int(generation.uniforms[child, parent, draw] * fitness.size)
                    best = agent if fitness[agent] > fitness[best] else best
                generation.parents[child, parent] = best


class Truncation(Selection, name="truncation"):
    """A random agent of the fitter half (n // 2 of n agents). Ties are broken at random."""

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        n_best = max(1, generation.fitness.size // 2)
        # Random numbers [child, 1, 0] break ties, and [child, 0, parent] choose parents.
        sort_from_fittest(
            generation.fitness, generation.uniforms[:, 1, 0], generation.shares, generation.order
        )
        for child in range(generation.parents.shape[0]):
            for parent in range(2):
                generation.parents[child, parent] = generation.order[
                    draw_index(n_best, generation.uniforms[child, 0, parent])
                ]


class BestCopies(Selection, name="best-copies"):
    """The best agents are parents and have equal numbers of children; a child has one parent.

    If the children cannot be divided equally, the fittest agents have one child more.
    The fraction `two_parent_share` of the children has a second parent among the best agents.

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
    def select(part: Any, generation: Generation) -> None:
        parents = generation.parents
        # The sum with 0.5 is rounded down, so the product is rounded to the nearest integer.
        n_best = max(1, int(part.parent_share * generation.fitness.size + 0.5))
        # Equal agents are in random order.
        sort_from_fittest(
            generation.fitness, generation.uniforms[:, 1, 0], generation.shares, generation.order
        )
        for child in range(parents.shape[0]):
            parents[child, 0] = parents[child, 1] = generation.order[child % n_best]
            if generation.uniforms[child, 0, 0] < part.two_parent_share:
                parents[child, 1] = generation.order[int(generation.uniforms[child, 0, 1] * n_best)]


class MuPlusLambda(Selection, name="mu-plus-lambda"):
    """The mu fittest agents survive, and are the parents of lambda children.

    Both parents of a child are random survivors. mu + lambda is the size of the population. The
    fitness of survivors is evaluated again in each generation. Ties are broken at random.

    References
    ----------
    Schwefel 1981; Beyer and Schwefel 2002.
    """

    survivor_share: float = Field(
        0.125,
        gt=0,
        lt=1,
        description=(
            "Share mu / (mu + lambda) of the population that survives; at least one agent "
            "survives, and at least one is a child."
        ),
    )

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        parents = generation.parents
        n_agents = parents.shape[0]
        # The sum with 0.5 is rounded down, so the product is rounded to the nearest integer.
        n_survivors = min(n_agents - 1, int(part.survivor_share * n_agents + 0.5))
        n_survivors = max(1, n_survivors)
        # The default `mark_survivors` uses the same random numbers and so chooses the same agents.
        sort_from_fittest(
            generation.fitness, generation.uniforms[:, 1, 3], generation.shares, generation.order
        )
        for child in range(n_agents):
            if child < n_survivors:
                parents[child, 0] = generation.order[child]
                parents[child, 1] = ITSELF
            else:
                for parent in range(2):
                    rank = draw_index(n_survivors, generation.uniforms[child, 0, parent])
                    parents[child, parent] = generation.order[rank]


class Rank(Selection, name="rank"):
    """Probability proportional to the rank, 1 for the lowest fitness.

    Agents with equal fitness all have the mean of their ranks.

    References
    ----------
    Baker 1985.
    """

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        fitness = generation.fitness
        order = generation.order
        sort_by(fitness, fitness, order)
        first = 0
        for end in range(1, fitness.size + 1):
            if end == fitness.size or fitness[order[end]] != fitness[order[first]]:
                # Agents order[first:end] are equal and have the ranks first + 1 to end.
                mean_rank = 0.5 * (first + 1 + end)
                for index in range(first, end):
                    generation.shares[order[index]] = mean_rank
                first = end
        spin(generation.uniforms, generation.shares, generation.parents)
