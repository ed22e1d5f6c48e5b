"""NEAT once more, in plain Python: a genome is read into a dictionary of genes by innovation number, and written back.

What `parts` must come to, whatever the way there: populations are lists [agent][module][entry], `draws` are [child][row][4].
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from baldwinlab.evolution.neat.genome import (
    BEST,
    BEST_OF_ALL,
    GENE,
    HEAD,
    INPUTS,
    LEDGER,
    NEWEST,
    OUTPUTS,
    SPECIES,
    STALE,
    STALE_OF_ALL,
)  # fmt: skip
from baldwinlab.evolution.neat.species import SMALL
from baldwinlab.parts.evolution_parts import ITSELF

Genes = dict[int, list[float]]  # by number: source, target, weight, enabled


def genes_of(graph: Any) -> Genes:
    genes = [graph[first : first + GENE] for first in range(HEAD, len(graph), GENE)]
    return {
        int(number): [source, target, weight, enabled]
        for number, source, target, weight, enabled in genes
        if number
    }


def distance(part: Any, one: Genes, other: Genes) -> float:
    last = min(max(one), max(other))
    alone = set(one) ^ set(other)
    excess = sum(number > last for number in alone)
    shared = [abs(one[number][2] - other[number][2]) for number in set(one) & set(other)]
    size = max(len(one), len(other))
    size = 1 if size < SMALL else size
    mean = sum(shared) / len(shared) if shared else 0.0
    return float(
        part.excess_coefficient * excess / size
        + part.disjoint_coefficient * (len(alone) - excess) / size
        + part.weight_coefficient * mean
    )


def activate(graph: Any, steepness: float, inputs: Any) -> list[float]:
    """The outputs for some inputs: each node asks those before it, as there are no loops."""
    first, outputs = int(graph[INPUTS]), int(graph[OUTPUTS])
    enabled = [gene for gene in genes_of(graph).values() if gene[3]]

    def value(node: float) -> float:
        if node < first:
            return float(inputs[int(node)])
        total = sum(
            weight * value(source) for source, target, weight, _ in enabled if target == node
        )
        return float(1 / (1 + np.exp(-steepness * total)))

    return [value(first + output) for output in range(outputs)]


def step(
    graph: Any, steepness: float, inputs: Any, before: dict[float, float]
) -> dict[float, float]:
    """What nodes say that hear anybody, by name, where all answer at once: they hear inputs now, and nodes as `before`."""
    first = int(graph[INPUTS])
    heard = before | {float(node): float(value) for node, value in enumerate(inputs)}
    totals: dict[float, float] = {}
    for source, target, weight, enabled in genes_of(graph).values():
        if enabled:
            totals[target] = totals.get(target, 0.0) + weight * heard.get(source, 0.0)
    assert not any(target < first for target in totals)
    return {target: float(1 / (1 + np.exp(-steepness * total))) for target, total in totals.items()}


def _standings(genome: Any, fitness: Any) -> dict[float, dict[str, Any]]:
    """How each species stands, the oldest first."""
    found: dict[float, dict[str, Any]] = {}
    for species in sorted({agent[0][SPECIES] for agent in genome}):
        members = [number for number, agent in enumerate(genome) if agent[0][SPECIES] == species]
        head, best = (
            genome[members[0]][0],
            max(float(np.float32(fitness[number])) for number in members),
        )
        gains = best > head[BEST]
        stale = 0 if gains else int(head[STALE]) + 1
        mean = sum(fitness[number] for number in members) / len(members)
        found[species] = {
            "members": members,
            "mean": mean,
            "now": best,
            "best": max(best, head[BEST]),
            "stale": stale,
        }
    return found


def _standing_of_all(genome: Any, fitness: Any) -> tuple[float, int]:
    best, before = float(np.float32(max(fitness))), genome[0][0][BEST_OF_ALL]
    return max(best, before), 0 if best > before else int(genome[0][0][STALE_OF_ALL]) + 1


def _breeding(part: Any, genome: Any, fitness: Any) -> dict[float, dict[str, Any]]:
    """The species that have children."""
    there, (_, stale) = _standings(genome, fitness), _standing_of_all(genome, fitness)
    periods, since = divmod(stale, part.population_stagnation_generations + 1)
    if periods and since == 0:
        best = sorted(there, key=lambda species: (-there[species]["now"], species))[:2]
        return {species: there[species] for species in there if species in best}
    found = {
        species: each
        for species, each in there.items()
        if (min(each["stale"], since) if periods else each["stale"]) < part.stagnation_generations
    }
    return found or there


def parents(part: Any, genome: Any, fitness: Any, uniforms: Any) -> list[list[int]]:
    breeding = _breeding(part, genome, fitness)
    means = [each["mean"] for each in breeding.values()]
    if not any(means):
        means = [1.0] * len(means)
    everybody = sorted(
        range(len(genome)), key=lambda agent: (-genome[agent][0][SPECIES], fitness[agent], agent)
    )
    found: list[list[int]] = []
    for number, each in enumerate(breeding.values()):
        best_first = sorted(each["members"], key=lambda agent: (-fitness[agent], -agent))
        best = best_first[: int(float(part.survival_threshold) * len(best_first)) + 1]
        until, first = int(sum(means[: number + 1]) * len(uniforms) / sum(means) + 0.5), len(found)
        for draws in uniforms[first:until]:
            one, other = best[int(draws[0][0] * len(best))], best[int(draws[0][3] * len(best))]
            if draws[0][2] < part.interspecies_mating_rate:
                other = everybody[int(draws[0][3] * len(everybody))]
            found.append([one, one if draws[0][1] < part.single_parent_share else other])
        if len(best_first) > part.champion_species_size and until > first:
            found[first] = [best_first[0], ITSELF]
    return found


def children(
    part: Any, genome: Any, fitness: Any, pairs: Any, draws: Any
) -> list[list[list[float]]]:
    room = (len(genome[0][0]) - HEAD) // GENE
    ledger, known = int(genome[0][0][LEDGER]), dict[tuple[str, float, float], int]()
    made: list[Genes] = []
    for (one, other), (of_child, of_new, *of_links) in zip(pairs, draws, strict=True):
        if (
            other != ITSELF
            and one != other
            and (part.blind or fitness[one] == fitness[other])
            and of_new[2] < 0.5
        ):
            one, other = other, one
        genes = genes_of(genome[one][0])
        made.append(genes)
        if other == ITSELF:
            continue
        if one != other:
            _cross(part, genes, genes_of(genome[other][0]), of_links)
        if of_child[0] < part.weight_mutation_rate:
            for gene, draw in zip(genes.values(), of_links, strict=False):
                size = 2 * draw[3] - 1
                gene[2] = (
                    gene[2] + size * part.perturbation_size
                    if draw[2] < part.perturbation_share
                    else size * part.weight_range
                )
        bias = genome[0][0][INPUTS] - 1
        splittable = [
            number for number in sorted(genes) if genes[number][3] and genes[number][0] != bias
        ]
        if of_child[1] < part.add_node_rate and splittable and len(genes) + 2 <= room:
            source, target, weight, _ = split = genes[
                splittable[int(of_child[3] * len(splittable))]
            ]
            node = known.setdefault(("node", source, target), ledger + 1)
            ledger = max(ledger, node + 1)
            known[("link", source, node)], known[("link", node, target)] = node, node + 1
            split[3] = 0.0
            genes |= {node: [source, node, 1.0, 1.0], node + 1: [node, target, weight, 1.0]}
        pairs_there = _open_pairs(part, genome[0][0], genes)
        if of_child[2] < part.add_link_rate and pairs_there and len(genes) + 1 <= room:
            source, target = pairs_there[int(of_new[0] * len(pairs_there))]
            number = known.setdefault(("link", source, target), ledger + 1)
            ledger = max(ledger, number)
            genes[number] = [source, target, (2 * of_new[1] - 1) * part.weight_range, 1.0]
    heads = _heads(part, genome, fitness, made, draws, ledger)
    return [[_written(head, genes, room)] for head, genes in zip(heads, made, strict=True)]


def _cross(part: Any, genes: Genes, others: Genes, draws: Any) -> None:
    for (number, gene), draw in zip(sorted(genes.items()), draws, strict=False):
        disabled = not gene[3] or (number in others and not others[number][3])
        if number in others and draw[0] >= 0.5:
            gene[2] = others[number][2]
        gene[3] = float(not disabled or draw[1] >= part.disabled_link_rate)


def _open_pairs(part: Any, head: Any, genes: Genes) -> list[tuple[float, float]]:
    """Pairs of nodes without a link, from which none leads back unless there are loops."""
    inputs, fixed = int(head[INPUTS]), int(head[INPUTS] + head[OUTPUTS])
    nodes = [*range(fixed), *(number for number in sorted(genes) if genes[number][1] == number)]
    behind: dict[float, set[float]] = {node: {node} for node in nodes}
    for _ in nodes:
        for source, target, _, _ in genes.values():
            behind[source] |= behind[target]
    joined = {(gene[0], gene[1]) for gene in genes.values()}
    pairs = [(source, target) for source in nodes for target in nodes[inputs:]]
    return [
        pair
        for pair in pairs
        if pair not in joined and (part.loops or pair[0] not in behind[pair[1]])
    ]


def _heads(
    part: Any, genome: Any, fitness: Any, made: list[Genes], draws: Any, ledger: int
) -> list[list[float]]:
    """The heads of the children's genomes: which species each is of, and how that stands."""
    there = _standings(genome, fitness)
    best_of_all, stale_of_all = _standing_of_all(genome, fitness)
    species: list[tuple[float, Genes, float, int]] = []  # number, representative, best, stale
    for count, (number, each) in enumerate(there.items()):
        member = each["members"][int(draws[count][1][3] * len(each["members"]))]
        species.append((number, genes_of(genome[member][0]), each["best"], each["stale"]))
    newest = genome[0][0][NEWEST]
    heads = []
    for genes in made:
        mine = next(
            (
                each
                for each in species
                if distance(part, each[1], genes) < part.compatibility_threshold
            ),
            None,
        )
        if mine is None:
            newest += 1
            species.append(mine := (newest, genes, -inf, 0))
        head = list(genome[0][0][:HEAD])
        head[SPECIES], head[BEST], head[STALE] = mine[0], mine[2], mine[3]
        head[LEDGER], head[BEST_OF_ALL], head[STALE_OF_ALL] = ledger, best_of_all, stale_of_all
        heads.append(head)
    for head in heads:
        head[NEWEST] = newest
    return heads


def _written(head: list[float], genes: Genes, room: int) -> list[float]:
    written = [entry for number, gene in sorted(genes.items()) for entry in (number, *gene)]
    return [*head, *written, *[0.0] * (GENE * (room - len(genes)))]
