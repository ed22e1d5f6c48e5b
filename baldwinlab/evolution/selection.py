"""Selection: who become parents.

A scheme fills `parents` int32 [child, 2] with agents, drawn independently and with replacement, from `fitness` float64 [agent]
and `uniforms` float64 [child, 2, 4] in (0, 1). It has scratch of its own: `shares` float64 [agent] and `order` int64 [agent].

Source: the paper, "Simulation 1: Evolution alone (EVO)"; docs/explanation/model.md for the alternatives (R4).
"""

from __future__ import annotations

import math
from itertools import accumulate
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine import poison
from baldwinlab.engine.jit import compiled, entry, kept
from baldwinlab.evolution.rng_key import Fitness, Genome, Parents, Uniforms
from baldwinlab.evolution.sorting import Keys, Order, sort_by
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts.evolution_parts import (
    ITSELF,
    Selection,
    breeding_part,
    keep_first,
    mark_survivors,
    select_with_genomes,
)


def select(
    experiment: BaseExperiment, fitness: Fitness, uniforms: Uniforms, genome: Genome | None = None
) -> Parents:
    """Two parents for each child, the fitter one first; of equals, the one drawn first. Who lives on has `ITSELF` for the other.

    `genome` is for schemes that look at it. Raises ValueError for a fitness that the scheme cannot work with.
    """
    scheme, code = breeding_part(experiment, "selection")
    least, where = (
        type(scheme).part.least,
        f"evolution.selection = {experiment.evolution.selection!r}",
    )
    if (agent := find_invalid_fitness(fitness, least)) >= 0:
        needed = (
            "0 or more: choose rank or tournament, or a fitness that is never negative"
            if least == 0
            else "a finite number"
        )
        raise ValueError(
            f"{where}: the fitness of agent {agent} is {fitness[agent]:g} and must be {needed}"
        )
    agents, parents = fitness.size, np.full((len(uniforms), 2), -1, np.int32)
    looked_at = np.empty((agents, 0, 0), np.float32) if genome is None else genome
    scratch = poison.empty(agents), poison.empty(agents, np.int64)
    kept(select_parents, code)(
        scheme, experiment.evolution.elite, looked_at, fitness, uniforms, *scratch, parents
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
    """Fill `parents` by a scheme, the fitter one first, and let the elite live on in the place of the first children."""
    select_with_genomes(scheme, genome, fitness, uniforms, shares, order, parents)
    mark_survivors(scheme, elite, fitness, uniforms, parents)
    for child in range(parents.shape[0]):
        first, second = parents[child, 0], parents[child, 1]
        if second >= 0 and fitness[second] > fitness[first]:
            parents[child, 0], parents[child, 1] = second, first


@entry
def has_invalid_parent(parents: Parents, agents: int) -> bool:
    """Whether a parent is none of the agents."""
    found = False
    for child in range(parents.shape[0]):
        first, second = parents[child, 0], parents[child, 1]
        found = found or not (0 <= first < agents and (second == ITSELF or 0 <= second < agents))
    return found


@entry
def find_invalid_fitness(fitness: Fitness, least: float) -> int:
    """The first agent whose fitness is not finite, or is below `least`; -1 if there is none."""
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
        fought = [[int(draw * len(fitness)) for draw in draws[0]] for draws in uniforms]
        return [
            [max(pair, key=lambda agent: fitness[agent]) for pair in (four[:2], four[2:])]
            for four in fought
        ]


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
        keep_first(count, uniforms[:, 1, 3], uniforms[:, 1, 3], parents)  # anybody lives on, too

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        return [[int(draw * len(fitness)) for draw in draws[0][:2]] for draws in uniforms]


def is_neutral_control(part: Any, experiment: BaseExperiment) -> bool:
    """For a part's `derived`: whether it is in a neutral twin, where nobody's fitness matters."""
    return experiment.evolution.selection == Neutral.name


def _spin_oracle(shares: Any, uniforms: Any) -> Any:
    """The oracle's roulette wheel: whose slice, one after another, the draw falls in."""
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
    """One of the whole numbers below `count`."""
    return np.int64(uniform * count)


@compiled
def _spin(uniforms: Uniforms, shares: Keys, parents: Parents) -> None:
    """A roulette wheel: probability proportional to the share, uniform if nobody has one. Afterwards `shares` are added up."""
    nobody = True
    for agent in range(shares.size):
        nobody = nobody and shares[agent] == 0.0
    total = 0.0
    for agent in range(shares.size):
        total += 1.0 if nobody else shares[agent]
        shares[agent] = total
    for child in range(parents.shape[0]):
        for parent in range(2):
            parents[child, parent] = find_first_above(shares, uniforms[child, 0, parent] * total)


@compiled
def find_first_above(rising: Keys, value: float) -> Any:
    """The first place where there is more than `value`, at most the last."""
    low, high = np.int64(0), np.int64(rising.size - 1)
    while low < high:
        middle = (low + high) // 2
        if rising[middle] > value:
            high = middle
        else:
            low = middle + 1
    return low
