"""Variation of networks: crossover by historical marks, weight mutation, new nodes and links.

A new link gets the next innovation number of the run. All genomes store the last number. If two
children of a generation get the same new structure, it has the same number in both. A search of the
earlier children finds this number.

The paper leaves some rules open. Our choices are as follows. Any enabled link that does not come
from the bias can be split, as in the authors' program, from memory. A new link can join any two
nodes without a link if the link closes no loop, or if the task allows loops. The weight of a new
link is from U(-range, range).

References
----------
Stanley and Miikkulainen 2002, sections 3.1, 3.2 and 4.1.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import ONE, ZERO
from baldwinlab.evolution.neat.genome import (
    ENABLED,
    GENE_SIZE,
    INNOVATION,
    INPUTS,
    SOURCE,
    TARGET,
    WEIGHT,
    Graph,
    count_links,
    count_nodes,
    defines_node,
    gene_offset,
    has_path,
    link_capacity,
    link_number,
    node_number,
)
from baldwinlab.evolution.rng_key import Genome

# Random numbers in (0, 1) of a child, [row, 4].
Draws = npt.NDArray[np.float64]
# First row of `draws` for links. The four columns of a row decide, in this order:
# Row 0: whether weights mutate, whether a node is added, whether a link is added, the split link.
# Row 1: nodes of a new link, weight of the new link, parent that gives the structure, unused.
# Rows of links: parent of the weight, whether a disabled link is enabled, whether the weight is
# perturbed or drawn again, size of the change.
FIRST_LINK_ROW = 2


@compiled
def cross(part: Any, mate: Graph, draws: Draws, child: Graph) -> None:
    """Cross a child, which is a copy of one parent, with the other parent.

    A matching gene has the weight of a random parent. Genes of a single parent do not change.
    """
    mate_link = 0
    mate_links = count_links(mate)
    for link in range(count_links(child)):
        gene = gene_offset(link)
        # Skip the genes of the mate that the child does not have.
        while (
            mate_link < mate_links
            and mate[gene_offset(mate_link) + INNOVATION] < child[gene + INNOVATION]
        ):
            mate_link += 1
        # A gene is enabled for certain only if it is enabled in all parents that have it.
        enabled = child[gene + ENABLED] > ZERO
        if (
            mate_link < mate_links
            and mate[gene_offset(mate_link) + INNOVATION] == child[gene + INNOVATION]
        ):
            enabled = enabled and mate[gene_offset(mate_link) + ENABLED] > ZERO
            if draws[FIRST_LINK_ROW + link, 0] >= 0.5:
                child[gene + WEIGHT] = mate[gene_offset(mate_link) + WEIGHT]
        child[gene + ENABLED] = (
            ONE if enabled or draws[FIRST_LINK_ROW + link, 1] >= part.disabled_link_rate else ZERO
        )


@compiled
def mutate_weights(part: Any, draws: Draws, child: Graph) -> None:
    """Mutate all weights of a child, or none.

    A weight changes by U(-perturbation, perturbation) or is drawn again from U(-range, range).
    """
    if draws[0, 0] < part.weight_mutation_rate:
        for link in range(count_links(child)):
            entry = gene_offset(link) + WEIGHT
            size = 2.0 * draws[FIRST_LINK_ROW + link, 3] - 1.0
            if draws[FIRST_LINK_ROW + link, 2] < part.perturbation_share:
                child[entry] += np.float32(size * np.float64(part.perturbation_size))
            else:
                child[entry] = np.float32(size * np.float64(part.weight_range))


@compiled
def add_node(part: Any, draws: Draws, children: Genome, number: int, first: int, last: int) -> Any:
    """Split a link of child `number` by a new node, and return the last innovation number.

    The old link is disabled. The link to the new node has the weight 1. The link from the new node
    has the weight of the old link. `first` is the first innovation number of this generation.
    `last` is the last innovation number before the call.
    """
    child = children[number, 0]
    n_splittable = 0
    for link in range(count_links(child)):
        n_splittable += int(_can_be_split(child, link))
    has_capacity = count_links(child) + 2 <= link_capacity(child)
    if draws[0, 1] >= part.add_node_rate or n_splittable == 0 or not has_capacity:
        return last
    # Number of splittable links before the split one.
    n_before = int(draws[0, 3] * n_splittable)
    gene = 0
    for link in range(count_links(child)):
        if _can_be_split(child, link):
            if n_before == 0:
                gene = gene_offset(link)
            n_before -= 1
    source = child[gene + SOURCE]
    target = child[gene + TARGET]
    weight = child[gene + WEIGHT]
    child[gene + ENABLED] = ZERO
    node = np.float32(_find_equal_node(children, number, first, source, target))
    # No earlier child split this link: the two new links get the next two innovation numbers.
    if node == ZERO:
        node = np.float32(last + 1)
        last = last + 2
    _insert(child, node, source, node, ONE)
    _insert(child, node + ONE, node, target, weight)
    return last


@compiled
def _can_be_split(graph: Graph, link: int) -> bool:
    """Return whether a link is enabled and does not come from the bias."""
    return bool(
        graph[gene_offset(link) + ENABLED] > ZERO
        and graph[gene_offset(link) + SOURCE] != graph[INPUTS] - ONE
    )


@compiled
def add_link(
    part: Any, draws: Draws, children: Genome, number: int, first: int, last: int, marks: Any
) -> Any:
    """Join two nodes of child `number` that have no link; return the last innovation number.

    `first` and `last` are as in `add_node`. `marks` [link] is scratch.
    """
    child = children[number, 0]
    has_capacity = count_links(child) + 1 <= link_capacity(child)
    if draws[0, 2] >= part.add_link_rate or not has_capacity:
        return last
    # The first call only counts the pairs.
    n_pairs, _, _ = _find_open_pair(child, part.loops, -1, marks)
    if n_pairs == 0:
        return last
    _, source, target = _find_open_pair(child, part.loops, int(draws[1, 0] * n_pairs), marks)
    link = np.float32(_find_equal_link(children, number, first, source, target))
    if link == ZERO:
        link = np.float32(last + 1)
        last = last + 1
    weight = np.float32((2.0 * draws[1, 1] - 1.0) * np.float64(part.weight_range))
    _insert(child, link, source, target, weight)
    return last


@compiled
def _find_open_pair(graph: Graph, loops: bool, index: int, marks: Any) -> Any:
    """Return (number of node pairs that a new link can join, source and target of pair `index`)."""
    count = 0
    nodes = count_nodes(graph)
    source = ZERO
    target = ZERO
    for begin in range(nodes):
        # A link never leads to an input.
        for end in range(int(graph[INPUTS]), nodes):
            first = node_number(graph, begin)
            second = node_number(graph, end)
            if link_number(graph, first, second) == ZERO:
                is_allowed = loops or not has_path(graph, second, first, marks)
                if is_allowed:
                    if count == index:
                        source = first
                        target = second
                    count += 1
    return count, source, target


@compiled
def _find_equal_node(children: Genome, number: int, first: int, source: Any, target: Any) -> Any:
    """Return the node by which an earlier child split the same link in this generation, or 0."""
    equal_node = ZERO
    for earlier in range(number):
        child = children[earlier, 0]
        for link in range(count_links(child)):
            node = child[gene_offset(link) + INNOVATION]
            is_split = (
                node >= first
                and defines_node(child, link)
                and child[gene_offset(link) + SOURCE] == source
            )
            # A split adds the links `node`, to the new node, and `node + 1`, from the new node.
            if is_split and link_number(child, node, target) == node + ONE:
                equal_node = node
    return equal_node


@compiled
def _find_equal_link(children: Genome, number: int, first: int, source: Any, target: Any) -> Any:
    """Return the number of the same new link in an earlier child of this generation, or 0."""
    equal_link = ZERO
    for earlier in range(number):
        link = link_number(children[earlier, 0], source, target)
        if link >= first:
            equal_link = link
    return equal_link


@compiled
def _insert(graph: Graph, number: Any, source: Any, target: Any, weight: Any) -> None:
    """Insert an enabled gene in the order of innovation numbers."""
    link = count_links(graph)
    while link > 0 and graph[gene_offset(link - 1) + INNOVATION] > number:
        for entry in range(GENE_SIZE):
            graph[gene_offset(link) + entry] = graph[gene_offset(link - 1) + entry]
        link -= 1
    gene = gene_offset(link)
    graph[gene + INNOVATION] = number
    graph[gene + SOURCE] = source
    graph[gene + TARGET] = target
    graph[gene + WEIGHT] = weight
    graph[gene + ENABLED] = ONE
