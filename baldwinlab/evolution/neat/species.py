"""Species: compatibility distance, species of children, status of species, and reproduction.

A species is represented by a random member of the generation of the parents. A child belongs to the
first species, the oldest first, whose representative is nearer than a threshold. If there is none,
the child founds a new species. The head of each genome stores the species number and the number of
generations without improvement. Therefore, a generation follows from the previous one only.

The paper does not define for how long only the two best species reproduce. As in the authors'
program, from memory, this lasts for one generation. Then the count starts again.

References
----------
Stanley and Miikkulainen 2002, sections 3.3 and 4.1.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.neat.genome import (
    BEST,
    INNOVATION,
    LAST_SPECIES,
    POPULATION_BEST,
    POPULATION_STALE,
    SPECIES,
    STALE,
    WEIGHT,
    ZERO,
    Graph,
    count_links,
    gene_offset,
)
from baldwinlab.evolution.rng_key import Fitness, GenerationKey, Genome

# The distance of networks with fewer links is not divided by their size.
SMALL_NETWORK: Final = 20


@compiled
def distance(part: Any, first: Graph, second: Graph) -> float:
    """Compute the compatibility distance c1 E / N + c2 D / N + c3 W.

    E and D are the numbers of excess and disjoint genes, N is the larger number of genes, and W is
    the mean difference of the weights of matching genes.
    """
    first_link = 0
    second_link = 0
    first_links = count_links(first)
    second_links = count_links(second)
    disjoint = 0
    matching = 0
    difference = 0.0
    while first_link < first_links and second_link < second_links:
        a = gene_offset(first_link)
        b = gene_offset(second_link)
        if first[a + INNOVATION] == second[b + INNOVATION]:
            difference += abs(np.float64(first[a + WEIGHT]) - np.float64(second[b + WEIGHT]))
            matching += 1
        else:
            disjoint += 1
        advances_first = first[a + INNOVATION] <= second[b + INNOVATION]
        advances_second = first[a + INNOVATION] >= second[b + INNOVATION]
        first_link += int(advances_first)
        second_link += int(advances_second)
    excess = first_links - first_link + second_links - second_link
    size = max(first_links, second_links)
    genes = (
        np.float64(part.excess_coefficient) * excess
        + np.float64(part.disjoint_coefficient) * disjoint
    )
    return genes / (size if size >= SMALL_NETWORK else 1) + np.float64(part.weight_coefficient) * (
        difference / max(1, matching)
    )


@compiled
def next_species(genome: Genome, after: Any) -> Any:
    """Return the smallest species number above `after`, or 0 if there is none."""
    smallest = ZERO
    for agent in range(genome.shape[0]):
        species = genome[agent, 0, SPECIES]
        if species > after and (smallest == ZERO or species < smallest):
            smallest = species
    return smallest


@compiled
def species_status(genome: Genome, fitness: Fitness, species: Any) -> Any:
    """Return the status of a species.

    Returns
    -------
    size : int
        Number of members.
    mean : float
        Mean fitness.
    best : float
        Best fitness.
    best_ever : float
        Best fitness in all generations.
    stale : int
        Number of generations without an increase of `best_ever`.
    """
    size = 0
    total = 0.0
    best = -math.inf
    before = -math.inf
    stale = 0
    for agent in range(fitness.size):
        if genome[agent, 0, SPECIES] == species:
            size = size + 1
            total = total + fitness[agent]
            best = max(best, np.float64(np.float32(fitness[agent])))
            before = np.float64(genome[agent, 0, BEST])
            stale = int(genome[agent, 0, STALE])
    return size, total / max(1, size), best, max(best, before), 0 if best > before else stale + 1


@compiled
def population_status(genome: Genome, fitness: Fitness) -> Any:
    """Return the best fitness of all generations, and the generations without its increase."""
    best = -math.inf
    for agent in range(fitness.size):
        best = max(best, np.float64(np.float32(fitness[agent])))
    before = np.float64(genome[0, 0, POPULATION_BEST])
    return max(best, before), 0 if best > before else int(genome[0, 0, POPULATION_STALE]) + 1


@compiled
def can_reproduce(part: Any, genome: Genome, fitness: Fitness, species: Any) -> bool:
    """Return whether a species has children.

    A species has none after a long time without improvement. If the population does not improve,
    only the two best species have children.
    """
    _, stale_of_all = population_status(genome, fitness)
    period = part.population_stagnation_generations + 1
    if stale_of_all > 0 and stale_of_all % period == 0:
        return _count_better_species(genome, fitness, species) < 2
    stale = species_status(genome, fitness, species)[4]
    # The count starts again after a generation in which only the two best species reproduced.
    if stale_of_all > period:
        stale = min(stale, stale_of_all % period)
    return bool(stale < part.stagnation_generations)


@compiled
def _count_better_species(genome: Genome, fitness: Fitness, species: Any) -> int:
    """Return the number of better species. Of equal species, the older is better."""
    best_of_species = species_status(genome, fitness, species)[2]
    count = 0
    competitor = next_species(genome, 0)
    while competitor > ZERO:
        best = species_status(genome, fitness, competitor)[2]
        count += int(best > best_of_species or (best == best_of_species and competitor < species))
        competitor = next_species(genome, competitor)
    return count


@compiled
def assign_species(
    part: Any, key: GenerationKey, genome: Genome, fitness: Fitness, children: Genome
) -> None:
    """Write the species of each child and its status into the heads of the genomes."""
    best_of_all, stale_of_all = population_status(genome, fitness)
    for child in range(children.shape[0]):
        children[child, 0, SPECIES] = ZERO
        children[child, 0, POPULATION_BEST] = np.float32(best_of_all)
        children[child, 0, POPULATION_STALE] = np.float32(stale_of_all)
    species = next_species(genome, 0)
    count = 0
    while species > ZERO:
        size, _, _, best, stale = species_status(genome, fitness, species)
        draw = rng.uniform(
            rng.philox(1, count, key.generation, rng.INHERITANCE, key.seed, key.run)[3]
        )
        representative = genome[_find_member(genome, species, int(draw * size)), 0]
        _add_children(part, representative, species, np.float32(best), stale, children)
        species = next_species(genome, species)
        count = count + 1
    newest = genome[0, 0, LAST_SPECIES]
    for child in range(children.shape[0]):
        if children[child, 0, SPECIES] == ZERO:
            newest += np.float32(1)
            _add_children(part, children[child, 0], newest, np.float32(-math.inf), 0, children)
    for child in range(children.shape[0]):
        children[child, 0, LAST_SPECIES] = newest


@compiled
def _find_member(genome: Genome, species: Any, number: int) -> int:
    """Return the agent that is member `number` of a species."""
    member = 0
    for agent in range(genome.shape[0]):
        if genome[agent, 0, SPECIES] == species:
            if number == 0:
                member = agent
            number -= 1
    return member


@compiled
def _add_children(
    part: Any, representative: Graph, species: Any, best: Any, stale: int, children: Genome
) -> None:
    """Add children without a species to a species if they are near its representative."""
    for child in range(children.shape[0]):
        graph = children[child, 0]
        if (
            graph[SPECIES] == ZERO
            and distance(part, representative, graph) < part.compatibility_threshold
        ):
            graph[SPECIES] = species
            graph[BEST] = best
            graph[STALE] = np.float32(stale)
