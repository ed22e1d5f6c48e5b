"""Selection of parents.

A scheme fills `parents` int32 [child, 2] from `fitness` float64 [agent] and `uniforms` float64
[child, 2, 4] in (0, 1). Parents are drawn independently and with replacement. `shares` float64
[agent] and `order` int64 [agent] are scratch arrays.

References
----------
Le 2019, section "Simulation 1: Evolution alone (EVO)". docs/explanation/model.md lists the other
interpretations of this section (R4).
"""

from __future__ import annotations

import math
from itertools import accumulate
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine import poison
from baldwinlab.engine.jit import cached_jit, compiled, jit_entry_point
from baldwinlab.evolution.rng_key import Fitness, Genome, Parents, Uniforms
from baldwinlab.evolution.sorting import Keys, Order, sort_by
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts.breeding import ITSELF, breeding_part
from baldwinlab.parts.selection import Selection, mark_fittest, mark_survivors, select_with_genomes


def select(
    experiment: BaseExperiment, fitness: Fitness, uniforms: Uniforms, genome: Genome | None = None
) -> Parents:
    """Select two parents for each child, the fitter one first.

    Parameters
    ----------
    experiment : BaseExperiment
        The experiment, with the selection scheme and the elite.
    fitness : Fitness
        Fitness, [agent].
    uniforms : Uniforms
        Uniform numbers in (0, 1), [child, 2, 4].
    genome : Genome, optional
        Genomes, for schemes that read them.

    Returns
    -------
    Parents
        Agents, [child, 2]. Of two equal parents the first drawn comes first. A survivor has
        `ITSELF` as its second parent.

    Raises
    ------
    ValueError
        If the scheme cannot work with a fitness, or selects an agent that does not exist.
    """
    scheme, code = breeding_part(experiment, "selection")
    least = type(scheme).part.least
    where = f"evolution.selection = {experiment.evolution.selection!r}"
    if (agent := find_invalid_fitness(fitness, least)) >= 0:
        needed = (
            "0 or more: choose rank or tournament, or a fitness that is never negative"
            if least == 0
            else "a finite number"
        )
        raise ValueError(
            f"{where}: the fitness of agent {agent} is {fitness[agent]:g} and must be {needed}"
        )
    agents = fitness.size
    parents = np.full((len(uniforms), 2), -1, np.int32)
    genomes = np.empty((agents, 0, 0), np.float32) if genome is None else genome
    scratch = poison.empty(agents), poison.empty(agents, np.int64)
    cached_jit(select_parents, code)(
        scheme, experiment.evolution.elite, genomes, fitness, uniforms, *scratch, parents
    )
    if has_invalid_parent(parents, agents):
        raise ValueError(f"{where} chose a parent that is none of the {agents} agents")
    return parents


def select_parents(
    scheme: Any,
    elite: int,
    genome: Genome,
    fitness: Fitness,
    uniforms: Uniforms,
    shares: Keys,
    order: Order,
    parents: Parents,
) -> None:
    """Fill `parents` by a scheme, the fitter one first. The elite replaces the first children."""
    select_with_genomes(scheme, genome, fitness, uniforms, shares, order, parents)
    mark_survivors(scheme, elite, fitness, uniforms, parents)
    for child in range(parents.shape[0]):
        first = parents[child, 0]
        second = parents[child, 1]
        if second >= 0 and fitness[second] > fitness[first]:
            parents[child, 0], parents[child, 1] = second, first


@jit_entry_point
def has_invalid_parent(parents: Parents, agents: int) -> bool:
    """Return whether a parent is not an index of an agent."""
    is_invalid = False
    for child in range(parents.shape[0]):
        first = parents[child, 0]
        second = parents[child, 1]
        is_valid = 0 <= first < agents and (second == ITSELF or 0 <= second < agents)
        is_invalid = is_invalid or not is_valid
    return is_invalid


@jit_entry_point
def find_invalid_fitness(fitness: Fitness, least: float) -> int:
    """Return the first agent whose fitness is not finite or is below `least`, or -1."""
    for agent in range(fitness.size):
        if not (least <= fitness[agent] < math.inf and fitness[agent] > -math.inf):
            return agent
    return -1


class Roulette(Selection, name="roulette"):
    """Probability proportional to fitness, which must not be negative.

    If the fitness of all agents is 0, all have the same probability.

    References
    ----------
    Le 2019.
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
        for agent in range(fitness.size):
            shares[agent] = fitness[agent]
        _spin(uniforms, shares, parents)

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        return _spin_oracle(fitness, uniforms)


class Tournament(Selection, name="tournament"):
    """The fitter of two randomly drawn agents.

    References
    ----------
    Goldberg and Deb 1991.
    """

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
                first = _any_of(fitness.size, uniforms[child, 0, 2 * parent])
                second = _any_of(fitness.size, uniforms[child, 0, 2 * parent + 1])
                parents[child, parent] = second if fitness[second] > fitness[first] else first

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        def winner(draws: Any) -> int:
            return max(
                (int(draw * len(fitness)) for draw in draws), key=lambda agent: fitness[agent]
            )

        return [[winner(draws[0][:2]), winner(draws[0][2:])] for draws in uniforms]


class Truncation(Selection, name="truncation"):
    """A random agent of the fitter half, rounded down. Ties are broken at random."""

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        half = max(1, fitness.size // 2)
        for agent in range(fitness.size):
            shares[agent] = -fitness[agent]
        sort_by(shares, uniforms[:, 1, 0], order)
        for child in range(parents.shape[0]):
            for parent in range(2):
                parents[child, parent] = order[_any_of(half, uniforms[child, 0, parent])]

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        order = sorted(
            range(len(fitness)), key=lambda agent: (-fitness[agent], uniforms[agent][1][0])
        )
        best = order[: max(1, len(order) // 2)]
        return [[best[int(draw * len(best))] for draw in draws[0][:2]] for draws in uniforms]


class Rank(Selection, name="rank"):
    """Probability proportional to the rank, 1 for the lowest fitness.

    Equal agents share the mean of their ranks.
    """

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        sort_by(fitness, fitness, order)
        first = 0
        for place in range(1, fitness.size + 1):
            if place == fitness.size or fitness[order[place]] != fitness[order[first]]:
                for equal in range(first, place):
                    shares[order[equal]] = 0.5 * (first + 1 + place)
                first = place
        _spin(uniforms, shares, parents)

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        ranks = [
            0.5 + sum((other < own) + 0.5 * (other == own) for other in fitness) for own in fitness
        ]
        return _spin_oracle(ranks, uniforms)


class Neutral(Selection, name="neutral"):
    """A random agent, independent of fitness: the neutral control."""

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
                parents[child, parent] = _any_of(fitness.size, uniforms[child, 0, parent])

    @staticmethod
    def mark_survivors(
        part: Any, count: int, fitness: Fitness, uniforms: Uniforms, parents: Parents
    ) -> None:
        # Survivors are random too.
        mark_fittest(count, uniforms[:, 1, 3], uniforms[:, 1, 3], parents)

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        return [[int(draw * len(fitness)) for draw in draws[0][:2]] for draws in uniforms]


def is_neutral_control(part: Any, experiment: BaseExperiment) -> bool:
    """Return whether fitness has no effect on selection, for `derived` of a part."""
    return experiment.evolution.selection == Neutral.name


def _spin_oracle(shares: Any, uniforms: Any) -> Any:
    """Return the parents that a roulette wheel selects, for oracles."""
    slices = list(accumulate(shares if any(shares) else [1.0 for _ in shares]))
    return [
        [
            next(k for k, end in enumerate(slices) if draw * slices[-1] < end)
            for draw in draws[0][:2]
        ]
        for draws in uniforms
    ]


@compiled
def _any_of(count: int, uniform: float) -> Any:
    """Return a random integer below `count`."""
    return np.int64(uniform * count)


@compiled
def _spin(uniforms: Uniforms, shares: Keys, parents: Parents) -> None:
    """Draw `parents` with probability proportional to `shares`; uniform if all are 0.

    The function replaces `shares` by their cumulative sums.
    """
    is_uniform = True
    for agent in range(shares.size):
        is_uniform = is_uniform and shares[agent] == 0.0
    total = 0.0
    for agent in range(shares.size):
        total += 1.0 if is_uniform else shares[agent]
        shares[agent] = total
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
