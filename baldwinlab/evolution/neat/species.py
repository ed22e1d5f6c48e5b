"""Species: how far apart two networks are, which species a child is of, how species stand, and which of them may breed.

A species is represented by anybody of it in the generation of the parents; a child is of the first one, the oldest first, whose
representative is nearer than a threshold, and founds another where there is none. Its number, and since when its best has
not been surpassed, stand in the head of every genome, so that a generation follows from the one before and from nothing else.

Source: Stanley and Miikkulainen 2002, sections 3.3 and 4.1. How long the search stays narrowed to the two best species is open
there: as, to our memory, in the authors' program for one generation, after which counting begins anew.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.neat.genome import (
    BEST,
    BEST_OF_ALL,
    NEWEST,
    NUMBER,
    SPECIES,
    STALE,
    STALE_OF_ALL,
    WEIGHT,
    ZERO,
    Graph,
    gene_at,
    links_of,
)
from baldwinlab.evolution.rng_key import Fitness, GenerationKey, Genome

SMALL: Final = 20  # networks with fewer links are compared without regard to their size


@compiled
def distance(part: Any, one: Graph, other: Graph) -> float:
    """The compatibility distance: c1 E / N + c2 D / N + c3 W, of excess and disjoint genes and the mean difference of weights."""
    mine, theirs, of_one, of_other = 0, 0, links_of(one), links_of(other)
    disjoint, matching, difference = 0, 0, 0.0
    while mine < of_one and theirs < of_other:
        a, b = gene_at(mine), gene_at(theirs)
        if one[a + NUMBER] == other[b + NUMBER]:
            difference += abs(np.float64(one[a + WEIGHT]) - np.float64(other[b + WEIGHT]))
            matching += 1
        else:
            disjoint += 1
        ahead, behind = one[a + NUMBER] <= other[b + NUMBER], one[a + NUMBER] >= other[b + NUMBER]
        mine, theirs = mine + int(ahead), theirs + int(behind)
    excess, size = of_one - mine + of_other - theirs, max(of_one, of_other)
    genes = (
        np.float64(part.excess_coefficient) * excess
        + np.float64(part.disjoint_coefficient) * disjoint
    )
    return genes / (size if size >= SMALL else 1) + np.float64(part.weight_coefficient) * (
        difference / max(1, matching)
    )


@compiled
def next_species(genome: Genome, after: Any) -> Any:
    """The species with the least number above `after`; 0 if there is none."""
    found = ZERO
    for agent in range(genome.shape[0]):
        species = genome[agent, 0, SPECIES]
        if species > after and (found == ZERO or species < found):
            found = species
    return found


@compiled
def standing(genome: Genome, fitness: Fitness, species: Any) -> Any:
    """Of a species: its size, mean and best fitness; the best it ever had; for how many generations that has not risen."""
    size, total, best, before, stale = 0, 0.0, -math.inf, -math.inf, 0
    for agent in range(fitness.size):
        if genome[agent, 0, SPECIES] == species:
            size, total, best = (
                size + 1,
                total + fitness[agent],
                max(best, np.float64(np.float32(fitness[agent]))),
            )
            before, stale = np.float64(genome[agent, 0, BEST]), int(genome[agent, 0, STALE])
    return size, total / max(1, size), best, max(best, before), 0 if best > before else stale + 1


@compiled
def standing_of_all(genome: Genome, fitness: Fitness) -> Any:
    """Of the population: the best fitness that it ever had; for how many generations that has not risen."""
    best = -math.inf
    for agent in range(fitness.size):
        best = max(best, np.float64(np.float32(fitness[agent])))
    before = np.float64(genome[0, 0, BEST_OF_ALL])
    return max(best, before), 0 if best > before else int(genome[0, 0, STALE_OF_ALL]) + 1


@compiled
def may_breed(part: Any, genome: Genome, fitness: Fitness, species: Any) -> bool:
    """Whether a species has children: not for long without a gain, and where all are, only one of the two best."""
    _, stale_of_all = standing_of_all(genome, fitness)
    period = part.population_stagnation_generations + 1
    if stale_of_all > 0 and stale_of_all % period == 0:
        return _ahead(genome, fitness, species) < 2
    stale = standing(genome, fitness, species)[4]
    if stale_of_all > period:  # since the search was narrowed
        stale = min(stale, stale_of_all % period)
    return bool(stale < part.stagnation_generations)


@compiled
def _ahead(genome: Genome, fitness: Fitness, species: Any) -> int:
    """How many species have a better best; of equals the older."""
    own, count = standing(genome, fitness, species)[2], 0
    other = next_species(genome, 0)
    while other > ZERO:
        best = standing(genome, fitness, other)[2]
        count += int(best > own or (best == own and other < species))
        other = next_species(genome, other)
    return count


@compiled
def settle(
    part: Any, key: GenerationKey, genome: Genome, fitness: Fitness, children: Genome
) -> None:
    """Say of every child which species it is of, and how that stands, in the heads of their genomes."""
    best_of_all, stale_of_all = standing_of_all(genome, fitness)
    for child in range(children.shape[0]):
        children[child, 0, SPECIES] = ZERO
        children[child, 0, BEST_OF_ALL], children[child, 0, STALE_OF_ALL] = (
            np.float32(best_of_all),
            np.float32(stale_of_all),
        )
    species, count = next_species(genome, 0), 0
    while species > ZERO:
        size, _, _, best, stale = standing(genome, fitness, species)
        draw = rng.uniform(
            rng.philox(1, count, key.generation, rng.INHERITANCE, key.seed, key.run)[3]
        )
        representative = genome[_member(genome, species, int(draw * size)), 0]
        _take(part, representative, species, np.float32(best), stale, children)
        species, count = next_species(genome, species), count + 1
    newest = genome[0, 0, NEWEST]
    for child in range(children.shape[0]):
        if children[child, 0, SPECIES] == ZERO:
            newest += np.float32(1)
            _take(part, children[child, 0], newest, np.float32(-math.inf), 0, children)
    for child in range(children.shape[0]):
        children[child, 0, NEWEST] = newest


@compiled
def _member(genome: Genome, species: Any, number: int) -> int:
    """Somebody of a species, by number."""
    found = 0
    for agent in range(genome.shape[0]):
        if genome[agent, 0, SPECIES] == species:
            if number == 0:
                found = agent
            number -= 1
    return found


@compiled
def _take(
    part: Any, representative: Graph, species: Any, best: Any, stale: int, children: Genome
) -> None:
    """Take all children into a species that are near its representative, and of no other yet."""
    for child in range(children.shape[0]):
        graph = children[child, 0]
        if (
            graph[SPECIES] == ZERO
            and distance(part, representative, graph) < part.compatibility_threshold
        ):
            graph[SPECIES], graph[BEST], graph[STALE] = species, best, np.float32(stale)
