"""Selection: who become parents.

A scheme fills `parents` int32 [child, 2] with agents, drawn independently and with replacement, from `fitness` float64 [agent]
and `uniforms` float64 [child, 2, 4] in (0, 1). It has scratch of its own: `shares` float64 [agent] and `order` int64 [agent].

Source: the paper, "Simulation 1: Evolution alone (EVO)"; docs/model.md for the alternatives (R4).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.engine.jit import compiled, entry, kept
from baldwinlab.evolution.moment import Fitness, Parents, Uniforms
from baldwinlab.evolution.sorting import Keys, Order, sort_by


class Scheme(NamedTuple):
    fill: Callable[[Fitness, Uniforms, Keys, Order, Parents], None]
    least: float = -math.inf  # the lowest fitness that it copes with


def select(scheme: str, fitness: Fitness, uniforms: Uniforms) -> Parents:
    """Two parents for each child, the fitter one first; of equals, the one drawn first.

    Raises ValueError for a scheme that there is not, and for a fitness that the scheme cannot work with.
    """
    if scheme not in SCHEMES:
        raise ValueError(f"evolution.selection = {scheme!r} must be one of {', '.join(SCHEMES)}")
    fill, least = SCHEMES[scheme]
    if (agent := misfit(fitness, least)) >= 0:
        needed = "0 or more: choose rank or tournament, or a fitness that is never negative" if least == 0 else "a finite number"
        raise ValueError(
            f"evolution.selection = {scheme!r}: the fitness of agent {agent} is {fitness[agent]:g} and must be {needed}"
        )
    agents = fitness.size
    parents = np.empty((len(uniforms), 2), np.int32)
    kept(fill)(fitness, uniforms, np.empty(agents), np.empty(agents, np.int64), parents)
    put_fitter_first(fitness, parents)
    return parents


@entry
def misfit(fitness: Fitness, least: float) -> int:
    """The first agent whose fitness is not finite, or is below `least`; -1 if there is none."""
    for agent in range(fitness.size):
        if not (least <= fitness[agent] < math.inf and fitness[agent] > -math.inf):
            return agent
    return -1


@entry
def put_fitter_first(fitness: Fitness, parents: Parents) -> None:
    for child in range(parents.shape[0]):
        first, second = parents[child, 0], parents[child, 1]
        if fitness[second] > fitness[first]:
            parents[child, 0], parents[child, 1] = second, first


@compiled
def roulette(fitness: Fitness, uniforms: Uniforms, shares: Keys, order: Order, parents: Parents) -> None:
    """Probability proportional to fitness, which must not be negative; all alike if nobody has any."""
    for agent in range(fitness.size):
        shares[agent] = fitness[agent]
    _spin(uniforms, shares, parents)


@compiled
def tournament(fitness: Fitness, uniforms: Uniforms, shares: Keys, order: Order, parents: Parents) -> None:
    """The fitter one of two that are drawn."""
    for child in range(parents.shape[0]):
        for parent in range(2):
            first = _any_of(fitness.size, uniforms[child, 0, 2 * parent])
            second = _any_of(fitness.size, uniforms[child, 0, 2 * parent + 1])
            parents[child, parent] = second if fitness[second] > fitness[first] else first


@compiled
def truncation(fitness: Fitness, uniforms: Uniforms, shares: Keys, order: Order, parents: Parents) -> None:
    """Anyone of the upper half, rounded down; equals are put in random order."""
    half = max(1, fitness.size // 2)
    for agent in range(fitness.size):
        shares[agent] = -fitness[agent]
    sort_by(shares, uniforms[:, 1, 0], order)
    for child in range(parents.shape[0]):
        for parent in range(2):
            parents[child, parent] = order[_any_of(half, uniforms[child, 0, parent])]


@compiled
def rank(fitness: Fitness, uniforms: Uniforms, shares: Keys, order: Order, parents: Parents) -> None:
    """Probability proportional to the rank, from 1 for the least fit; equals share the mean of theirs."""
    sort_by(fitness, fitness, order)
    first = 0
    for place in range(1, fitness.size + 1):
        if place == fitness.size or fitness[order[place]] != fitness[order[first]]:
            for equal in range(first, place):
                shares[order[equal]] = 0.5 * (first + 1 + place)
            first = place
    _spin(uniforms, shares, parents)


@compiled
def neutral(fitness: Fitness, uniforms: Uniforms, shares: Keys, order: Order, parents: Parents) -> None:
    """Anyone, whatever the fitness: the neutral twin of every other scheme."""
    for child in range(parents.shape[0]):
        for parent in range(2):
            parents[child, parent] = _any_of(fitness.size, uniforms[child, 0, parent])


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
            parents[child, parent] = _first_above(shares, uniforms[child, 0, parent] * total)


@compiled
def _first_above(rising: Keys, value: float) -> Any:
    """The first place where there is more than `value`, at most the last."""
    low, high = np.int64(0), np.int64(rising.size - 1)
    while low < high:
        middle = (low + high) // 2
        if rising[middle] > value:
            high = middle
        else:
            low = middle + 1
    return low


SCHEMES: Final[Mapping[str, Scheme]] = {
    "roulette": Scheme(roulette, least=0.0),
    "tournament": Scheme(tournament),
    "truncation": Scheme(truncation),
    "rank": Scheme(rank),
    "neutral": Scheme(neutral),
}
