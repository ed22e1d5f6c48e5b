"""Children of networks: crossover by historical marks, weight mutation, new nodes and new links.

New structures get the next innovation number of the run, which each genome stores. If the same
structure arises twice in a generation, it gets the same number. To find this number, the earlier
children of the generation are searched.

The paper leaves some rules open. Our choices are as follows. Any enabled link that does not come
from the bias can be split, as in the authors' program, from memory. A new link can join any two
nodes without a link if it closes no loop, or if the task allows loops. Its weight is from
U(-range, range).

References
----------
Stanley and Miikkulainen 2002, sections 3.1, 3.2 and 4.1.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.neat.genome import (
    ENABLED,
    GENE_SIZE,
    INNOVATION,
    INPUTS,
    ONE,
    SOURCE,
    TARGET,
    WEIGHT,
    ZERO,
    Graph,
    count_links,
    count_nodes,
    defines_node,
    gene_offset,
    has_link,
    has_path,
    link_capacity,
    node_number,
)
from baldwinlab.evolution.rng_key import Genome
from baldwinlab.evolution.variation import Draws

# First row of `draws` for links. Its columns are: parent of the weight, enabled again, perturbed or
# drawn again, size. Row 0 is for the child: weights mutate, new node, new link, split link. Row 1
# is: pair of linked nodes, weight, random parent, unused.
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
        while (
            mate_link < mate_links
            and mate[gene_offset(mate_link) + INNOVATION] < child[gene + INNOVATION]
        ):
            mate_link += 1
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
    """Split a link of child `number`: disable it and insert a node. Return the last number given.

    `first` is the first innovation number of this generation. The link to the node has the weight
    1. The link from the node has the weight of the old link.
    """
    child = children[number, 0]
    splittable = 0
    for link in range(count_links(child)):
        splittable += int(_can_be_split(child, link))
    if (
        draws[0, 1] >= part.add_node_rate
        or splittable == 0
        or count_links(child) + 2 > link_capacity(child)
    ):
        return last
    chosen = int(draws[0, 3] * splittable)
    gene = 0
    for link in range(count_links(child)):
        if _can_be_split(child, link):
            if chosen == 0:
                gene = gene_offset(link)
            chosen -= 1
    source = child[gene + SOURCE]
    target = child[gene + TARGET]
    weight = child[gene + WEIGHT]
    child[gene + ENABLED] = ZERO
    node = np.float32(_find_equal_node(children, number, first, source, target))
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
    """Join two nodes of child `number` that have no link. Return the last number given."""
    child = children[number, 0]
    if draws[0, 2] >= part.add_link_rate or count_links(child) + 1 > link_capacity(child):
        return last
    pairs = _find_open_pair(child, part.loops, -1, marks)[0]
    if pairs == 0:
        return last
    _, source, target = _find_open_pair(child, part.loops, int(draws[1, 0] * pairs), marks)
    link = np.float32(_find_equal_link(children, number, first, source, target))
    if link == ZERO:
        link = np.float32(last + 1)
        last = last + 1
    _insert(
        child,
        link,
        source,
        target,
        np.float32((2.0 * draws[1, 1] - 1.0) * np.float64(part.weight_range)),
    )
    return last


@compiled
def _find_open_pair(graph: Graph, loops: bool, chosen: int, marks: Any) -> Any:
    """Return the number of node pairs that a new link can join, and the pair number `chosen`."""
    count = 0
    nodes = count_nodes(graph)
    source = ZERO
    target = ZERO
    for begin in range(nodes):
        for end in range(int(graph[INPUTS]), nodes):
            first = node_number(graph, begin)
            second = node_number(graph, end)
            if not has_link(graph, first, second) and (
                loops or not has_path(graph, second, first, marks)
            ):
                if count == chosen:
                    source = first
                    target = second
                count += 1
    return count, source, target


@compiled
def _find_equal_node(children: Genome, number: int, first: int, source: Any, target: Any) -> Any:
    """Return the node by which an earlier child split such a link, or 0 if there is none."""
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
            if is_split and _link_number(child, node, target) == node + ONE:
                equal_node = node
    return equal_node


@compiled
def _find_equal_link(children: Genome, number: int, first: int, source: Any, target: Any) -> Any:
    """Return the number of such a link in an earlier child, or 0 if there is none."""
    number_of_link = ZERO
    for earlier in range(number):
        link = _link_number(children[earlier, 0], source, target)
        if link >= first:
            number_of_link = link
    return number_of_link


@compiled
def _link_number(graph: Graph, source: Any, target: Any) -> Any:
    """Return the number of the link from `source` to `target`, or 0 if there is none."""
    number = ZERO
    for link in range(count_links(graph)):
        if (
            graph[gene_offset(link) + SOURCE] == source
            and graph[gene_offset(link) + TARGET] == target
        ):
            number = graph[gene_offset(link) + INNOVATION]
    return number


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
