"""Assay of descent: ancestors, shares of founders, and the phylogeny in the ALife data standard."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.studies.assays.sample import Conditions, Sample

# Limits the memory for large populations.
FOUNDERS_PER_BATCH = 1024

# Parents [generation, agent, 2], as agents of the previous generation.
Parents = npt.NDArray[np.int32]


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    return {
        "generation": np.arange(study.experiments[condition].evolution.generations, dtype=np.int32)
    }


def count_lives(study: Conditions, condition: str) -> int:
    return 0


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """Compute `common_ancestor_age` and `effective_ancestors` [run, generation].

    The values are NaN if agents inherit no genome.
    """
    shape = (len(sample.runs), sample.experiment.evolution.generations)
    age = np.full(shape, np.nan)
    effective = np.full(shape, np.nan)
    if sample.experiment.evolution.inheritance != "none":
        for number, record in enumerate(sample.records):
            age[number] = common_ancestor_ages(record.parents.values)
            effective[number] = effective_ancestors(record.parents.values)
    return {"common_ancestor_age": age, "effective_ancestors": effective}


def common_ancestor_ages(parents: Parents) -> npt.NDArray[np.float64]:
    """Compute the age of the last common ancestor of each generation.

    An agent descends from both parents, and not from itself.

    Parameters
    ----------
    parents : ndarray of int32, shape (generation, agent, 2)
        Parents as agents of the previous generation.

    Returns
    -------
    ndarray of float, shape (generation,)
        Number of generations since the last common ancestor, NaN without one.
    """
    couples = parents.tolist()
    ages = [_common_ancestor_age(couples, generation) for generation in range(len(couples))]
    return np.array(ages)


def _common_ancestor_age(couples: list[list[list[int]]], generation: int) -> float:
    agents = len(couples[generation])
    all_agents = (1 << agents) - 1
    # The descendants of each agent are the bits of a number.
    descendants = [1 << agent for agent in range(agents)]
    for earlier in range(generation, 0, -1):
        previous = [0] * agents
        for child, (first_parent, second_parent) in enumerate(couples[earlier]):
            previous[first_parent] |= descendants[child]
            previous[second_parent] |= descendants[child]
        descendants = previous
        if all_agents in descendants:
            return generation - earlier + 1
    return float("nan")


def effective_ancestors(parents: Parents) -> npt.NDArray[np.float64]:
    """Compute the effective number of founders in each generation.

    It is 1 / sum of p^2, where p is the expected share of a founder's genes in the gene pool. Each
    parent contributes half of the genes of an agent.

    Parameters
    ----------
    parents : ndarray of int32, shape (generation, agent, 2)
        Parents as agents of the previous generation.

    Returns
    -------
    ndarray of float, shape (generation,)
        Effective number of founders.

    References
    ----------
    R. C. Lacy, Analysis of founder representation in pedigrees: founder equivalents and founder
    genome equivalents, Zoo Biology 8 (1989).
    """
    generations, agents, _ = parents.shape
    sum_of_squares = np.zeros(generations)
    for first in range(0, agents, FOUNDERS_PER_BATCH):
        # Shares [agent, founder].
        shares = np.eye(agents, min(FOUNDERS_PER_BATCH, agents - first), -first)
        sum_of_squares[0] += (shares.mean(axis=0) ** 2).sum()
        for generation in range(1, generations):
            first_parents, second_parents = parents[generation].T
            shares = (shares[first_parents] + shares[second_parents]) / 2
            sum_of_squares[generation] += (shares.mean(axis=0) ** 2).sum()
    return 1 / sum_of_squares


def list_ancestors(parents: Parents, generation: int, agent: int) -> list[npt.NDArray[np.int32]]:
    """Return the ancestors of an agent by generation: itself, its parents, and so on.

    The list ends with the ancestors that have no parents.
    """
    ancestors = [np.array([agent], np.int32)]
    while (previous := np.unique(parents[generation, ancestors[-1]])).min() >= 0:
        ancestors.append(previous)
        generation -= 1
    return ancestors


def trace_fitter_parents(parents: Parents, generation: int, agent: int) -> list[tuple[int, int]]:
    """Return the parents of an agent, the parents of the fitter parent, and so on.

    The fitter parent is the first of each pair.
    """
    couples = []
    while (couple := parents[generation, agent]).min() >= 0:
        couples.append((int(couple[0]), int(couple[1])))
        generation -= 1
        agent = couples[-1][0]
    return couples


PHYLOGENY_HEADER = "id,ancestor_list,origin_time,destruction_time"


def format_phylogeny(parents: Parents, first: int = 0) -> Iterator[str]:
    """Yield the lines of the phylogeny of a run in the ALife data standard, without its header.

    The id of an agent is first + generation * agents + its number in the generation. Its origin
    time is its generation, and its destruction time is the next one. `ancestor_list` contains the
    distinct parents, or `none` for an agent without parents.

    References
    ----------
    A. Lalejini et al., Data standards for artificial life software, ALIFE 2019.
    """
    agents = parents.shape[1]
    for generation, couples in enumerate(parents.tolist()):
        for agent, couple in enumerate(couples):
            offset = first + (generation - 1) * agents
            ids = [str(offset + parent) for parent in dict.fromkeys(couple) if parent >= 0]
            ancestors = ",".join(ids) or "none"
            number = first + generation * agents + agent
            yield f'{number},"[{ancestors}]",{generation},{generation + 1}'
