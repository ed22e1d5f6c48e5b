"""Species of networks: compatibility distance, assignment, status and permission to reproduce.

The representative of a species is a random member in the parents' generation. A child belongs to
the oldest species with a representative nearer than a threshold. If no representative is near,
the child is the first member of a new species. The head of each genome stores the species number
and the number of generations without improvement. Therefore, each generation depends on the
previous generation only.

If the population stagnates, only the two best species reproduce. The paper does not state the
number of generations. It is one here, as in the authors' program, from memory. Then the count of
generations without improvement starts again, until the best fitness of the population increases.
From then on, the stored count of a species applies, which also has the generations before the
restart. A species that has not improved for long can therefore lose its permission at once.

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
from baldwinlab.engine.simd import ZERO
from baldwinlab.evolution.neat.genome import (
    BEST,
    INNOVATION,
    LAST_SPECIES,
    POPULATION_BEST,
    POPULATION_STALE,
    SPECIES,
    STALE,
    WEIGHT,
    Graph,
    count_links,
    gene_offset,
)
from baldwinlab.evolution.rng_key import Fitness, GenerationKey, Genome

# The distance of networks with fewer links than this number is not divided by the number of links.
MIN_LINKS_FOR_DIVISION: Final = 20


@compiled
def distance(part: Any, first: Graph, second: Graph) -> float:
    """Compute the compatibility distance c1 E / N + c2 D / N + c3 W.

    E and D are the numbers of excess and disjoint genes. N is the larger of the two numbers of
    genes. W is the mean absolute difference of the weights of matching genes.
    """
    first_link = 0
    second_link = 0
    first_links = count_links(first)
    second_links = count_links(second)
    n_disjoint = 0
    n_matching = 0
    total_difference = 0.0
    while first_link < first_links and second_link < second_links:
        first_gene = gene_offset(first_link)
        second_gene = gene_offset(second_link)
        if first[first_gene + INNOVATION] == second[second_gene + INNOVATION]:
            total_difference += abs(
                np.float64(first[first_gene + WEIGHT]) - np.float64(second[second_gene + WEIGHT])
            )
            n_matching += 1
        else:
            n_disjoint += 1
        # Pass the gene with the smaller innovation number, or both genes if the numbers are equal.
        advances_first = first[first_gene + INNOVATION] <= second[second_gene + INNOVATION]
        advances_second = first[first_gene + INNOVATION] >= second[second_gene + INNOVATION]
        first_link += int(advances_first)
        second_link += int(advances_second)
    n_excess = first_links - first_link + second_links - second_link
    n_genes = max(first_links, second_links)
    weighted_unmatched = (
        np.float64(part.excess_coefficient) * n_excess
        + np.float64(part.disjoint_coefficient) * n_disjoint
    )
    divisor = n_genes if n_genes >= MIN_LINKS_FOR_DIVISION else 1
    mean_difference = total_difference / max(1, n_matching)
    return weighted_unmatched / divisor + np.float64(part.weight_coefficient) * mean_difference


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
    """Return (number of members, mean fitness, best, best_ever, stale) of a species.

    `best` is the best fitness of this generation, and `best_ever` of all generations until now.
    `stale` is the number of successive generations without an increase of `best_ever`.
    """
    size = 0
    total = 0.0
    best = -math.inf
    previous_best = -math.inf
    stale = 0
    for agent in range(fitness.size):
        if genome[agent, 0, SPECIES] == species:
            size = size + 1
            total = total + fitness[agent]
            # Genomes store the best fitness as float32, so the comparison is in float32.
            best = max(best, np.float64(np.float32(fitness[agent])))
            previous_best = np.float64(genome[agent, 0, BEST])
            stale = int(genome[agent, 0, STALE])
    best_ever = max(best, previous_best)
    stale = 0 if best > previous_best else stale + 1
    return size, total / max(1, size), best, best_ever, stale


@compiled
def population_status(genome: Genome, fitness: Fitness) -> Any:
    """Return (best fitness of all generations, number of generations since its last increase)."""
    best = -math.inf
    for agent in range(fitness.size):
        best = max(best, np.float64(np.float32(fitness[agent])))
    previous_best = np.float64(genome[0, 0, POPULATION_BEST])
    stale = 0 if best > previous_best else int(genome[0, 0, POPULATION_STALE]) + 1
    return max(best, previous_best), stale


@compiled
def can_reproduce(part: Any, genome: Genome, fitness: Fitness, species: Any) -> bool:
    """Return whether a species has children.

    A species has no children after `stagnation_generations` without improvement. After a period in
    which the population does not improve, only the two best species have children.
    """
    _, population_stale = population_status(genome, fitness)
    period = part.population_stagnation_generations + 1
    is_end_of_period = population_stale > 0 and population_stale % period == 0
    if is_end_of_period:
        return _count_better_species(genome, fitness, species) < 2
    stale = species_status(genome, fitness, species)[4]
    # The count starts again after a generation in which only the two best species reproduced.
    if population_stale > period:
        stale = min(stale, population_stale % period)
    return bool(stale < part.stagnation_generations)


@compiled
def _count_better_species(genome: Genome, fitness: Fitness, species: Any) -> int:
    """Return the number of better species. Of two equal species, the older one is better."""
    best_of_species = species_status(genome, fitness, species)[2]
    count = 0
    competitor = next_species(genome, 0)
    while competitor > ZERO:
        best = species_status(genome, fitness, competitor)[2]
        is_older_equal = best == best_of_species and competitor < species
        count += int(best > best_of_species or is_older_equal)
        competitor = next_species(genome, competitor)
    return count


@compiled
def assign_species(
    part: Any, key: GenerationKey, genome: Genome, fitness: Fitness, children: Genome
) -> None:
    """Write the species of each child, with the status of the species, into the genome's head."""
    population_best, population_stale = population_status(genome, fitness)
    for child in range(children.shape[0]):
        children[child, 0, SPECIES] = ZERO
        children[child, 0, POPULATION_BEST] = np.float32(population_best)
        children[child, 0, POPULATION_STALE] = np.float32(population_stale)
    species = next_species(genome, 0)
    species_index = 0
    while species > ZERO:
        size, _, _, best, stale = species_status(genome, fitness, species)
        # `Draws` of children leave row 1, column 3 unused.
        draw = rng.uniform(
            rng.philox(1, species_index, key.generation, rng.INHERITANCE, key.seed, key.run)[3]
        )
        representative_agent = _find_member(genome, species, int(draw * size))
        representative = genome[representative_agent, 0]
        _assign_near_children(part, representative, species, np.float32(best), stale, children)
        species = next_species(genome, species)
        species_index = species_index + 1
    # A child without a near representative becomes the representative of a new species.
    last_species = genome[0, 0, LAST_SPECIES]
    for child in range(children.shape[0]):
        if children[child, 0, SPECIES] == ZERO:
            last_species += np.float32(1)
            _assign_near_children(
                part, children[child, 0], last_species, np.float32(-math.inf), 0, children
            )
    for child in range(children.shape[0]):
        children[child, 0, LAST_SPECIES] = last_species


@compiled
def _find_member(genome: Genome, species: Any, member_index: int) -> int:
    """Return the agent at an index of the members of a species."""
    member = 0
    for agent in range(genome.shape[0]):
        if genome[agent, 0, SPECIES] == species:
            if member_index == 0:
                member = agent
            member_index -= 1
    return member


@compiled
def _assign_near_children(
    part: Any, representative: Graph, species: Any, best: Any, stale: int, children: Genome
) -> None:
    """Assign a species to all near children that have no species yet."""
    for child in range(children.shape[0]):
        graph = children[child, 0]
        if (
            graph[SPECIES] == ZERO
            and distance(part, representative, graph) < part.compatibility_threshold
        ):
            graph[SPECIES] = species
            graph[BEST] = best
            graph[STALE] = np.float32(stale)
