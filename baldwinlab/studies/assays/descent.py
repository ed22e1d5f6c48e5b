"""Descent, from the stored parents alone: ancestors, the founders' shares, and the pedigree in the ALife standard."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.studies.assays.sample import Conditions, Sample

FOUNDERS_PER_BATCH = 1024  # bounds the memory that a large world takes

Parents = npt.NDArray[np.int32]  # [generation, agent, 2], agents of the generation before


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    return {
        "generation": np.arange(study.experiments[condition].evolution.generations, dtype=np.int32)
    }


def count_lives(study: Conditions, condition: str) -> int:
    return 0


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """`common_ancestor_age` and `effective_ancestors` [run, generation]; NaN where nothing is inherited."""
    shape = (len(sample.runs), sample.experiment.evolution.generations)
    age, effective = np.full(shape, np.nan), np.full(shape, np.nan)
    if sample.experiment.evolution.inheritance != "none":
        for number, record in enumerate(sample.records):
            age[number] = common_ancestor_ages(record.parents.values)
            effective[number] = effective_ancestors(record.parents.values)
    return {"common_ancestor_age": age, "effective_ancestors": effective}


def common_ancestor_ages(parents: Parents) -> npt.NDArray[np.float64]:
    """For each generation, how many generations before it the last agent lived from whom all descend; NaN where there is none.

    An agent descends from both parents, and not from itself.
    """
    couples = parents.tolist()
    return np.array(
        [_common_ancestor_age(couples, generation) for generation in range(len(couples))]
    )


def _common_ancestor_age(couples: list[list[list[int]]], generation: int) -> float:
    agents = len(couples[generation])
    everybody = (1 << agents) - 1
    descendants = [1 << agent for agent in range(agents)]  # of each agent, as the bits of a number
    for earlier in range(generation, 0, -1):
        of_parents = [0] * agents
        for child, (one, other) in enumerate(couples[earlier]):
            of_parents[one] |= descendants[child]
            of_parents[other] |= descendants[child]
        descendants = of_parents
        if everybody in descendants:
            return generation - earlier + 1
    return float("nan")


def effective_ancestors(parents: Parents) -> npt.NDArray[np.float64]:
    """For each generation, 1 / sum of p^2 over the agents of the first, of whose genes the gene pool has the expected share p.

    Half of an agent's genes come from each parent. Source: Lacy, "Analysis of founder representation in pedigrees: founder
    equivalents and founder genome equivalents", Zoo Biology 8, 1989.
    """
    generations, agents, _ = parents.shape
    sum_of_squares = np.zeros(generations)
    for first in range(0, agents, FOUNDERS_PER_BATCH):
        shares = np.eye(agents, min(FOUNDERS_PER_BATCH, agents - first), -first)  # [agent, founder]
        sum_of_squares[0] += (shares.mean(axis=0) ** 2).sum()
        for generation in range(1, generations):
            one, other = parents[generation].T
            shares = (shares[one] + shares[other]) / 2
            sum_of_squares[generation] += (shares.mean(axis=0) ** 2).sum()
    return 1 / sum_of_squares


def count_ancestors(parents: Parents, generation: int, agent: int) -> list[npt.NDArray[np.int32]]:
    """All from whom an agent descends: itself, its parents, theirs, and so on back to those who inherited nothing."""
    found = [np.array([agent], np.int32)]
    while (before := np.unique(parents[generation, found[-1]])).min() >= 0:
        found.append(before)
        generation -= 1
    return found


def trace_fitter_parents(parents: Parents, generation: int, agent: int) -> list[tuple[int, int]]:
    """The parents of an agent, those of the fitter of them, and so on; of each couple the fitter one first."""
    couples = []
    while (couple := parents[generation, agent]).min() >= 0:
        couples.append((int(couple[0]), int(couple[1])))
        generation, agent = generation - 1, couples[-1][0]
    return couples


HEADER = "id,ancestor_list,origin_time,destruction_time"


def format_phylogeny(parents: Parents, first: int = 0) -> Iterator[str]:
    """The pedigree of a run in the ALife data standard, below `HEADER`.

    An agent is first + generation * agents + its number in its generation, which is its time; it is gone with the next.
    `ancestor_list` holds both parents, one of them where they are the same, and `none` where nothing was inherited.
    Source: Lalejini et al., "Data standards for artificial life software", ALIFE 2019.
    """
    agents = parents.shape[1]
    for generation, couples in enumerate(parents.tolist()):
        for agent, couple in enumerate(couples):
            before = first + (generation - 1) * agents
            ancestors = (
                ",".join(str(before + parent) for parent in dict.fromkeys(couple) if parent >= 0)
                or "none"
            )
            number = first + generation * agents + agent
            yield f'{number},"[{ancestors}]",{generation},{generation + 1}'
