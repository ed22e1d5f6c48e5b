"""Independent implementation of NEAT in plain Python.

The functions read a genome as a dictionary of genes by innovation number, and write it back. The
results must equal those of `baldwinlab.evolution.neat.operators`. Populations are lists
[agent][module][entry]. `draws` [child][row][4] are random numbers: row 0 for the child, row 1 for a
new link and for species, and one row for each link.
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from baldwinlab.evolution.neat.genome import (
    BEST,
    GENE_SIZE,
    HEAD_SIZE,
    INPUTS,
    LAST_INNOVATION,
    LAST_SPECIES,
    OUTPUTS,
    POPULATION_BEST,
    POPULATION_STALE,
    SPECIES,
    STALE,
    count_entries,
)  # fmt: skip
from baldwinlab.evolution.neat.species import MIN_LINKS_FOR_DIVISION
from baldwinlab.models.neat_networks import CORRECT_ANSWERS, QUESTIONS
from baldwinlab.parts.breeding import ITSELF

# By innovation number: [source, target, weight, enabled].
Genes = dict[int, list[float]]


def read_genes(graph: Any) -> Genes:
    """Return the genes of a network [entry]."""
    genes = [graph[first : first + GENE_SIZE] for first in range(HEAD_SIZE, len(graph), GENE_SIZE)]
    return {
        int(number): [source, target, weight, enabled]
        for number, source, target, weight, enabled in genes
        if number
    }


def distance(part: Any, first_genes: Genes, second_genes: Genes) -> float:
    """Compute the compatibility distance of two networks."""
    # Genes after the last gene of the shorter genome are excess genes.
    last_shared = min(max(first_genes), max(second_genes))
    unmatched = set(first_genes) ^ set(second_genes)
    n_excess = sum(number > last_shared for number in unmatched)
    n_disjoint = len(unmatched) - n_excess
    matching = set(first_genes) & set(second_genes)
    differences = [abs(first_genes[number][2] - second_genes[number][2]) for number in matching]
    n_genes = max(len(first_genes), len(second_genes))
    divisor = 1 if n_genes < MIN_LINKS_FOR_DIVISION else n_genes
    mean_difference = sum(differences) / len(differences) if differences else 0.0
    return float(
        part.excess_coefficient * n_excess / divisor
        + part.disjoint_coefficient * n_disjoint / divisor
        + part.weight_coefficient * mean_difference
    )


def activate(graph: Any, steepness: float, inputs: Any) -> list[float]:
    """Return the outputs of a network without loops, by recursion from the outputs."""
    first_output = int(graph[INPUTS])
    outputs = int(graph[OUTPUTS])
    enabled = [gene for gene in read_genes(graph).values() if gene[3]]

    def value(node: float) -> float:
        if node < first_output:
            return float(inputs[int(node)])
        total = sum(
            weight * value(source) for source, target, weight, _ in enabled if target == node
        )
        return float(1 / (1 + np.exp(-steepness * total)))

    return [value(first_output + output) for output in range(outputs)]


def step(
    graph: Any, steepness: float, inputs: Any, previous_values: dict[float, float]
) -> dict[float, float]:
    """Return the values of all nodes with incoming links after one simultaneous update.

    Links from nodes read `previous_values`. Links from inputs read the current `inputs`.
    """
    first_output = int(graph[INPUTS])
    sources = previous_values | {float(node): float(value) for node, value in enumerate(inputs)}
    totals: dict[float, float] = {}
    for source, target, weight, enabled in read_genes(graph).values():
        if enabled:
            totals[target] = totals.get(target, 0.0) + weight * sources.get(source, 0.0)
    assert not any(target < first_output for target in totals)
    return {target: float(1 / (1 + np.exp(-steepness * total))) for target, total in totals.items()}


def _species_status(genome: Any, fitness: Any) -> dict[float, dict[str, Any]]:
    """Return the status by number of the species, the oldest (smallest number) first."""
    result: dict[float, dict[str, Any]] = {}
    for species in sorted({modules[0][SPECIES] for modules in genome}):
        members = [agent for agent, modules in enumerate(genome) if modules[0][SPECIES] == species]
        head = genome[members[0]][0]
        # The engine stores the best fitness as float32.
        best = max(float(np.float32(fitness[agent])) for agent in members)
        is_improved = best > head[BEST]
        stale = 0 if is_improved else int(head[STALE]) + 1
        mean = sum(fitness[agent] for agent in members) / len(members)
        result[species] = {
            "members": members,
            "mean": mean,
            "current_best": best,
            "best": max(best, head[BEST]),
            "stale": stale,
        }
    return result


def _population_status(genome: Any, fitness: Any) -> tuple[float, int]:
    """Return the best fitness of all generations, and the number of generations without a rise."""
    best = float(np.float32(max(fitness)))
    previous_best = genome[0][0][POPULATION_BEST]
    is_improved = best > previous_best
    stale = 0 if is_improved else int(genome[0][0][POPULATION_STALE]) + 1
    return max(best, previous_best), stale


def _select_species(part: Any, genome: Any, fitness: Any) -> dict[float, dict[str, Any]]:
    """Return the status of the species that have children."""
    all_species = _species_status(genome, fitness)
    _, stale = _population_status(genome, fitness)
    n_periods, age_of_period = divmod(stale, part.population_stagnation_generations + 1)
    # At the end of a period without improvement, only the two best species have children.
    if n_periods and age_of_period == 0:
        best = sorted(
            all_species, key=lambda species: (-all_species[species]["current_best"], species)
        )[:2]
        return {species: all_species[species] for species in all_species if species in best}
    selected = {}
    for species, status in all_species.items():
        # A new period resets the counts of all species.
        species_stale = min(status["stale"], age_of_period) if n_periods else status["stale"]
        if species_stale < part.stagnation_generations:
            selected[species] = status
    return selected or all_species


def parents(part: Any, genome: Any, fitness: Any, uniforms: Any) -> list[list[int]]:
    """Return the parents [child][2] under the selection `species`. `uniforms`: [child][2][4]."""
    selected_species = _select_species(part, genome, fitness)
    means = [status["mean"] for status in selected_species.values()]
    if not any(means):
        means = [1.0] * len(means)
    all_agents = sorted(
        range(len(genome)), key=lambda agent: (-genome[agent][0][SPECIES], fitness[agent], agent)
    )
    pairs: list[list[int]] = []
    for species_index, status in enumerate(selected_species.values()):
        best_first = sorted(status["members"], key=lambda agent: (-fitness[agent], -agent))
        n_best = int(float(part.survival_threshold) * len(best_first)) + 1
        best = best_first[:n_best]
        cumulative_mean = sum(means[: species_index + 1])
        end = int(cumulative_mean * len(uniforms) / sum(means) + 0.5)
        first = len(pairs)
        for draws in uniforms[first:end]:
            first_parent = best[int(draws[0][0] * len(best))]
            second_parent = best[int(draws[0][3] * len(best))]
            if draws[0][2] < part.interspecies_mating_rate:
                second_parent = all_agents[int(draws[0][3] * len(all_agents))]
            if draws[0][1] < part.single_parent_share:
                second_parent = first_parent
            pairs.append([first_parent, second_parent])
        if len(best_first) > part.champion_species_size and end > first:
            pairs[first] = [best_first[0], ITSELF]
    return pairs


class _Innovations:
    """Innovation numbers of a generation. Equal innovations have equal numbers."""

    def __init__(self, last: int) -> None:
        self.last = last
        self._numbers = dict[tuple[str, float, float], int]()

    def number_link(self, source: float, target: float) -> int:
        """Return the number of a link. It is new if no child of the generation has the link."""
        number = self._numbers.setdefault(("link", source, target), self.last + 1)
        self.last = max(self.last, number)
        return number

    def number_node(self, source: float, target: float) -> int:
        """Return the number of the node that splits a link. Its output link has the next number."""
        node = self._numbers.setdefault(("node", source, target), self.last + 1)
        self.last = max(self.last, node + 1)
        self._numbers["link", source, node] = node
        self._numbers["link", node, target] = node + 1
        return node


def children(
    part: Any, genome: Any, fitness: Any, pairs: Any, draws: Any
) -> list[list[list[float]]]:
    """Return the genomes of the children under the variation `neat`."""
    max_links = (len(genome[0][0]) - HEAD_SIZE) // GENE_SIZE
    innovations = _Innovations(int(genome[0][0][LAST_INNOVATION]))
    offspring: list[Genes] = []
    for (first_parent, second_parent), (child_draws, new_link_draws, *link_draws) in zip(
        pairs, draws, strict=True
    ):
        has_two_parents = second_parent not in (ITSELF, first_parent)
        if has_two_parents and new_link_draws[2] < 0.5:
            is_fitter_unknown = part.blind or fitness[first_parent] == fitness[second_parent]
            if is_fitter_unknown:
                first_parent, second_parent = second_parent, first_parent
        genes = read_genes(genome[first_parent][0])
        offspring.append(genes)
        if second_parent == ITSELF:
            continue
        if first_parent != second_parent:
            _cross(part, genes, read_genes(genome[second_parent][0]), link_draws)
        if child_draws[0] < part.weight_mutation_rate:
            _mutate_weights(part, genes, link_draws)
        bias = genome[0][0][INPUTS] - 1
        splittable = [
            number for number in sorted(genes) if genes[number][3] and genes[number][0] != bias
        ]
        if child_draws[1] < part.add_node_rate and splittable and len(genes) + 2 <= max_links:
            split_link = splittable[int(child_draws[3] * len(splittable))]
            _split_link(genes, split_link, innovations)
        open_pairs = _open_pairs(part, genome[0][0], genes)
        if child_draws[2] < part.add_link_rate and open_pairs and len(genes) + 1 <= max_links:
            source, target = open_pairs[int(new_link_draws[0] * len(open_pairs))]
            number = innovations.number_link(source, target)
            genes[number] = [source, target, (2 * new_link_draws[1] - 1) * part.weight_range, 1.0]
    heads = _make_heads(part, genome, fitness, offspring, draws, innovations.last)
    return [
        [_write_genome(head, genes, max_links)]
        for head, genes in zip(heads, offspring, strict=True)
    ]


def _mutate_weights(part: Any, genes: Genes, draws: Any) -> None:
    """Perturb or replace the weight of each link."""
    for gene, draw in zip(genes.values(), draws, strict=False):
        size = 2 * draw[3] - 1
        is_perturbed = draw[2] < part.perturbation_share
        gene[2] = (
            gene[2] + size * part.perturbation_size if is_perturbed else size * part.weight_range
        )


def _split_link(genes: Genes, number: int, innovations: _Innovations) -> None:
    """Replace a link by a node with an input link of weight 1 and an output link."""
    source, target, weight, _ = genes[number]
    node = innovations.number_node(source, target)
    genes[number][3] = 0.0
    genes[node] = [source, node, 1.0, 1.0]
    genes[node + 1] = [node, target, weight, 1.0]


def _cross(part: Any, genes: Genes, mate_genes: Genes, draws: Any) -> None:
    """Cross the genes of a child (a copy of the first parent) with those of the second parent."""
    for (number, gene), draw in zip(sorted(genes.items()), draws, strict=False):
        disabled = not gene[3] or (number in mate_genes and not mate_genes[number][3])
        if number in mate_genes and draw[0] >= 0.5:
            gene[2] = mate_genes[number][2]
        gene[3] = float(not disabled or draw[1] >= part.disabled_link_rate)


def _open_pairs(part: Any, head: Any, genes: Genes) -> list[tuple[float, float]]:
    """Return the pairs of nodes that a new link can join."""
    inputs = int(head[INPUTS])
    fixed = int(head[INPUTS] + head[OUTPUTS])
    nodes = [*range(fixed), *(number for number in sorted(genes) if genes[number][1] == number)]
    reachable_nodes: dict[float, set[float]] = {node: {node} for node in nodes}
    for _ in nodes:
        for source, target, _, _ in genes.values():
            reachable_nodes[source] |= reachable_nodes[target]
    joined = {(gene[0], gene[1]) for gene in genes.values()}
    pairs = [(source, target) for source in nodes for target in nodes[inputs:]]
    return [
        pair
        for pair in pairs
        if pair not in joined and (part.loops or pair[0] not in reachable_nodes[pair[1]])
    ]


def _make_heads(
    part: Any, genome: Any, fitness: Any, offspring: list[Genes], draws: Any, last_innovation: int
) -> list[list[float]]:
    """Return the head of each child's genome, with the number and status of a species."""
    all_species = _species_status(genome, fitness)
    population_best, population_stale = _population_status(genome, fitness)
    # Number, representative, best fitness, and generations without improvement.
    species: list[tuple[float, Genes, float, int]] = []
    for species_index, (number, status) in enumerate(all_species.items()):
        members = status["members"]
        draw = draws[species_index][1][3]
        member = members[int(draw * len(members))]
        species.append((number, read_genes(genome[member][0]), status["best"], status["stale"]))
    last_species = genome[0][0][LAST_SPECIES]
    heads = []
    for genes in offspring:
        species_of_child = next(
            (
                candidate
                for candidate in species
                if distance(part, candidate[1], genes) < part.compatibility_threshold
            ),
            None,
        )
        if species_of_child is None:
            last_species += 1
            species.append(species_of_child := (last_species, genes, -inf, 0))
        head = list(genome[0][0][:HEAD_SIZE])
        head[SPECIES] = species_of_child[0]
        head[BEST] = species_of_child[2]
        head[STALE] = species_of_child[3]
        head[LAST_INNOVATION] = last_innovation
        head[POPULATION_BEST] = population_best
        head[POPULATION_STALE] = population_stale
        heads.append(head)
    for head in heads:
        head[LAST_SPECIES] = last_species
    return heads


def _write_genome(head: list[float], genes: Genes, max_links: int) -> list[float]:
    entries = [entry for number, gene in sorted(genes.items()) for entry in (number, *gene)]
    n_unused_entries = GENE_SIZE * (max_links - len(genes))
    return [*head, *entries, *[0.0] * n_unused_entries]


def choose_parents(part: Any, generation: Any) -> Any:
    """Return the parents of all children: the oracle of the selection."""
    return parents(part, generation.lifetimes.genome, generation.fitness, generation.uniforms)


def breed_children(part: Any, genome: Any, fitness: Any, parents: Any, draws: Any) -> Any:
    """Return all children: the oracle of the variation."""
    return children(part, genome, fitness, parents, draws)


def compute_outputs(part: Any, agent: Any, naive: Any) -> Any:
    """Return the outputs of an agent of MiniWorld: the oracle of the network."""
    weights = [float(entry) for entry in naive.weights(agent.action_module)]
    graph = weights[: count_entries(int(part.max_links))]
    return activate(graph, float(part.sigmoid_slope), [*agent.inputs, 1.0])


def compute_xor_fitness(model: Any, graph: Any) -> float:
    """Return the fitness of one network [entry] in the model `neat-xor`."""
    answers = [activate(graph, model.sigmoid_slope, (*question, 1))[0] for question in QUESTIONS]
    errors = [
        abs(answer - correct) for answer, correct in zip(answers, CORRECT_ANSWERS, strict=True)
    ]
    return float((len(QUESTIONS) - sum(errors)) ** 2)
