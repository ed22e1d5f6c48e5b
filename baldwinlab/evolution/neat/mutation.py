"""How a child's network comes of its parents': crossover by historical marks, mutated weights, a new node, a new link.

Innovations are numbered by the ledger of the run, whose last number every genome carries. The same structure that arises twice
in a generation gets the same numbers: whoever finds one looks among the children that were made before.

Source: Stanley and Miikkulainen 2002, sections 3.1, 3.2 and 4.1. Open there, and read so: any enabled link
may be split that does not come from the bias, as, to our memory, in the authors' program; a new link may join any two nodes that
none joins, if it closes no loop or the task has them, and has a weight of U(-range, range).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.neat.genome import (
    ENABLED,
    GENE,
    INPUTS,
    NUMBER,
    ONE,
    SOURCE,
    TARGET,
    WEIGHT,
    ZERO,
    Graph,
    gene_at,
    has_link,
    leads_to,
    links_of,
    makes_a_node,
    node_of,
    nodes_of,
    room,
)
from baldwinlab.evolution.rng_key import Genome
from baldwinlab.evolution.variation import Draws

OF_LINKS = 2  # the first row of `draws` that is a link's: (whose weight, enabled again, perturbed or anew, by how much)
# The rows before are the child's: (weights mutate, a node, a link, which is split), (which nodes are linked, weight, coin, -)


@compiled
def cross(part: Any, other: Graph, draws: Draws, child: Graph) -> None:
    """Make of a child that is one parent's copy that of two: of matching genes either weight; what only one has stays."""
    theirs, of_other = 0, links_of(other)
    for link in range(links_of(child)):
        gene = gene_at(link)
        while theirs < of_other and other[gene_at(theirs) + NUMBER] < child[gene + NUMBER]:
            theirs += 1
        enabled = child[gene + ENABLED] > ZERO
        if theirs < of_other and other[gene_at(theirs) + NUMBER] == child[gene + NUMBER]:
            enabled = enabled and other[gene_at(theirs) + ENABLED] > ZERO
            if draws[OF_LINKS + link, 0] >= 0.5:
                child[gene + WEIGHT] = other[gene_at(theirs) + WEIGHT]
        child[gene + ENABLED] = (
            ONE if enabled or draws[OF_LINKS + link, 1] >= part.disabled_link_rate else ZERO
        )


@compiled
def mutate_weights(part: Any, draws: Draws, child: Graph) -> None:
    """Let every weight change by U(-perturbation, perturbation), or be anew of U(-range, range); or, of some children, none."""
    if draws[0, 0] < part.weight_mutation_rate:
        for link in range(links_of(child)):
            place, size = gene_at(link) + WEIGHT, 2.0 * draws[OF_LINKS + link, 3] - 1.0
            if draws[OF_LINKS + link, 2] < part.perturbation_share:
                child[place] += np.float32(size * np.float64(part.perturbation_size))
            else:
                child[place] = np.float32(size * np.float64(part.weight_range))


@compiled
def add_node(part: Any, draws: Draws, children: Genome, number: int, first: int, last: int) -> Any:
    """Split a link of child `number`: disable it, and let a node take its place. Gives the ledger's last number.

    `first` is this generation's first. The link to the node weighs 1, the one from it what the old one did.
    """
    child = children[number, 0]
    splittable = 0
    for link in range(links_of(child)):
        splittable += int(_may_be_split(child, link))
    if draws[0, 1] >= part.add_node_rate or splittable == 0 or links_of(child) + 2 > room(child):
        return last
    chosen = int(draws[0, 3] * splittable)
    gene = 0
    for link in range(links_of(child)):
        if _may_be_split(child, link):
            if chosen == 0:
                gene = gene_at(link)
            chosen -= 1
    source, target, weight = child[gene + SOURCE], child[gene + TARGET], child[gene + WEIGHT]
    child[gene + ENABLED] = ZERO
    node = np.float32(_known_node(children, number, first, source, target))
    if node == ZERO:
        node, last = np.float32(last + 1), last + 2
    _insert(child, node, source, node, ONE)
    _insert(child, node + ONE, node, target, weight)
    return last


@compiled
def _may_be_split(graph: Graph, link: int) -> bool:
    """Whether a link is enabled and does not come from the bias."""
    return bool(
        graph[gene_at(link) + ENABLED] > ZERO
        and graph[gene_at(link) + SOURCE] != graph[INPUTS] - ONE
    )


@compiled
def add_link(
    part: Any, draws: Draws, children: Genome, number: int, first: int, last: int, marks: Any
) -> Any:
    """Join two nodes of child `number` that are not joined, in a loop only where there are. Gives the ledger's last number."""
    child = children[number, 0]
    if draws[0, 2] >= part.add_link_rate or links_of(child) + 1 > room(child):
        return last
    pairs = _pair(child, part.loops, -1, marks)[0]
    if pairs == 0:
        return last
    _, source, target = _pair(child, part.loops, int(draws[1, 0] * pairs), marks)
    link = np.float32(_known_link(children, number, first, source, target))
    if link == ZERO:
        link, last = np.float32(last + 1), last + 1
    _insert(
        child,
        link,
        source,
        target,
        np.float32((2.0 * draws[1, 1] - 1.0) * np.float64(part.weight_range)),
    )
    return last


@compiled
def _pair(graph: Graph, loops: bool, chosen: int, marks: Any) -> Any:
    """How many pairs of nodes a new link could join, and the chosen one of them, from the first source on."""
    count, nodes = 0, nodes_of(graph)
    source, target = ZERO, ZERO
    for begin in range(nodes):
        for end in range(int(graph[INPUTS]), nodes):
            one, other = node_of(graph, begin), node_of(graph, end)
            if not has_link(graph, one, other) and (
                loops or not leads_to(graph, other, one, marks)
            ):
                if count == chosen:
                    source, target = one, other
                count += 1
    return count, source, target


@compiled
def _known_node(children: Genome, number: int, first: int, source: Any, target: Any) -> Any:
    """The node that an earlier child of this generation has had by splitting such a link; 0 if none has."""
    found = ZERO
    for earlier in range(number):
        child = children[earlier, 0]
        for link in range(links_of(child)):
            node = child[gene_at(link) + NUMBER]
            splits = (
                node >= first
                and makes_a_node(child, link)
                and child[gene_at(link) + SOURCE] == source
            )
            if splits and _number_of(child, node, target) == node + ONE:
                found = node
    return found


@compiled
def _known_link(children: Genome, number: int, first: int, source: Any, target: Any) -> Any:
    """The number of such a link that an earlier child of this generation has; 0 if none has."""
    found = ZERO
    for earlier in range(number):
        link = _number_of(children[earlier, 0], source, target)
        if link >= first:
            found = link
    return found


@compiled
def _number_of(graph: Graph, source: Any, target: Any) -> Any:
    """The number of the link from one node to another; 0 if there is none."""
    number = ZERO
    for link in range(links_of(graph)):
        if graph[gene_at(link) + SOURCE] == source and graph[gene_at(link) + TARGET] == target:
            number = graph[gene_at(link) + NUMBER]
    return number


@compiled
def _insert(graph: Graph, number: Any, source: Any, target: Any, weight: Any) -> None:
    """Put a gene at its place in the order of numbers, enabled."""
    link = links_of(graph)
    while link > 0 and graph[gene_at(link - 1) + NUMBER] > number:
        for entry in range(GENE):
            graph[gene_at(link) + entry] = graph[gene_at(link - 1) + entry]
        link -= 1
    gene = gene_at(link)
    graph[gene + NUMBER], graph[gene + SOURCE], graph[gene + TARGET] = number, source, target
    graph[gene + WEIGHT], graph[gene + ENABLED] = weight, ONE
