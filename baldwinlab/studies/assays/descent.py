"""Assay of descent: ancestors, genes of founders, and the phylogeny in the ALife data standard."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import Variable
from baldwinlab.experiment import Experiment
from baldwinlab.studies.assays import Arrays, Assay, AssayPlan, Conditions, Sample

# Maximum number of columns of the matrix `shares`. It limits the memory for large populations.
FOUNDERS_PER_BATCH = 1024
# Bytes of a child and its parents as Python objects.
BYTES_PER_CHILD: Final = 150
BITS_PER_BYTE: Final = 8
# Number of arrays with the size of `shares` in the memory of `effective_ancestors`.
SHARE_COPIES: Final = 4
# Number of copies of the sets of descendants. A set has one bit per agent.
DESCENDANT_COPIES: Final = 2

# [generation, agent, 2]: indices of the parents of an agent in the previous generation, or -1.
Parents = npt.NDArray[np.int32]


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    generations = study.experiments[condition].evolution.generations
    return AssayPlan({"generation": np.arange(generations, dtype=np.int32)}, n_lives=0)


def measure(sample: Sample) -> Arrays:
    """Compute `common_ancestor_age` and `effective_ancestors` [run, generation].

    The values are NaN if agents inherit no genome.
    """
    shape = (len(sample.runs), sample.experiment.evolution.generations)
    ages = np.full(shape, np.nan)
    effective_numbers = np.full(shape, np.nan)
    if sample.experiment.evolution.inheritance != "none":
        for run_index, record in enumerate(sample.records):
            # A run that stopped keeps the values of its last generation.
            n_missing = shape[1] - record.sizes["generation"]
            for values, compute in (
                (ages, common_ancestor_ages),
                (effective_numbers, effective_ancestors),
            ):
                values[run_index] = np.pad(
                    compute(record.parents.values), (0, n_missing), mode="edge"
                )
    return {"common_ancestor_age": ages, "effective_ancestors": effective_numbers}


def estimate_memory(experiment: Experiment, n_runs: int) -> int:
    """Return the memory in bytes. The runs are measured one after the other."""
    n_agents = experiment.population.size
    n_shares = n_agents * min(n_agents, FOUNDERS_PER_BATCH)
    share_bytes = SHARE_COPIES * np.dtype(np.float64).itemsize * n_shares
    child_bytes = experiment.evolution.generations * BYTES_PER_CHILD
    descendant_bytes = DESCENDANT_COPIES * n_agents // BITS_PER_BYTE
    return n_agents * (child_bytes + descendant_bytes) + share_bytes


def common_ancestor_ages(parents: Parents) -> npt.NDArray[np.float64]:
    """Compute the age of the last common ancestor of each generation.

    An agent descends from both parents, and not from itself. Returns, for each generation, the
    number of generations since the last common ancestor of all agents, NaN without an ancestor.
    """
    couples = parents.tolist()
    ages = [_common_ancestor_age(couples, generation) for generation in range(len(couples))]
    return np.array(ages)


def _common_ancestor_age(couples: list[list[list[int]]], generation: int) -> float:
    """Return the age for one generation. `couples` are the parents as nested lists."""
    n_agents = len(couples[generation])
    # A set of agents is an integer with one bit per agent.
    all_agents = (1 << n_agents) - 1
    # For each agent of an earlier generation, the set of its descendants in `generation`.
    descendants = [1 << agent for agent in range(n_agents)]
    for child_generation in range(generation, 0, -1):
        descendants_of_parents = [0] * n_agents
        for child, (first_parent, second_parent) in enumerate(couples[child_generation]):
            descendants_of_parents[first_parent] |= descendants[child]
            descendants_of_parents[second_parent] |= descendants[child]
        descendants = descendants_of_parents
        if all_agents in descendants:
            parent_generation = child_generation - 1
            return generation - parent_generation
    return float("nan")


def effective_ancestors(parents: Parents) -> npt.NDArray[np.float64]:
    """Compute the effective number of founders in each generation.

    The number is 1 / sum of p^2 over the founders, where p is the expected fraction of all genes
    that descend from a founder. Each parent contributes half of the genes of an agent.

    References
    ----------
    R. C. Lacy, Analysis of founder representation in pedigrees: founder equivalents and founder
    genome equivalents, Zoo Biology 8 (1989).
    """
    n_generations, n_agents, _ = parents.shape
    sum_of_squares = np.zeros(n_generations)
    for first_founder in range(0, n_agents, FOUNDERS_PER_BATCH):
        n_founders = min(FOUNDERS_PER_BATCH, n_agents - first_founder)
        # [agent, founder]: expected fraction of the genes of an agent that descend from a founder.
        # In generation 0, agent i is founder i.
        shares = np.eye(n_agents, n_founders, k=-first_founder)
        sum_of_squares[0] += (shares.mean(axis=0) ** 2).sum()
        for generation in range(1, n_generations):
            first_parents, second_parents = parents[generation].T
            shares = (shares[first_parents] + shares[second_parents]) / 2
            sum_of_squares[generation] += (shares.mean(axis=0) ** 2).sum()
    return 1 / sum_of_squares


def list_ancestors(parents: Parents, generation: int, agent: int) -> list[npt.NDArray[np.int32]]:
    """Return the indices of an agent, of its parents, of its grandparents, and so on.

    The last entry contains the ancestors that have no parents.
    """
    ancestors = [np.array([agent], np.int32)]
    # Agents without parents have the parents -1.
    while (earlier_agents := np.unique(parents[generation, ancestors[-1]])).min() >= 0:
        ancestors.append(earlier_agents)
        generation -= 1
    return ancestors


def list_children(parents: Parents, agent: int) -> list[int]:
    """Return the children of an agent. `parents` [agent, 2]: parents of the next generation."""
    children: list[int] = np.flatnonzero((parents == agent).any(axis=1)).tolist()
    return children


def trace_fitter_parents(parents: Parents, generation: int, agent: int) -> list[tuple[int, int]]:
    """Return the parents of an agent, then the parents of its fitter parent, and so on.

    The first parent of each pair is the fitter parent.
    """
    couples = []
    # Agents without parents have the parents -1.
    while (couple := parents[generation, agent]).min() >= 0:
        fitter_parent, second_parent = couple.tolist()
        couples.append((fitter_parent, second_parent))
        generation -= 1
        agent = fitter_parent
    return couples


PHYLOGENY_HEADER = "id,ancestor_list,origin_time,destruction_time"


def format_phylogeny(parents: Parents, first_id: int = 0) -> Iterator[str]:
    """Yield the lines of the phylogeny of a run in the ALife data standard: `5,"[0,2]",1,2`.

    The id of an agent is first_id + generation * agents + its index in the generation. The origin
    time is the generation of the agent, and the destruction time is the next generation.
    `ancestor_list` contains the distinct parents, or `none` for an agent without parents.

    References
    ----------
    A. Lalejini et al., Data standards for artificial life software, ALIFE 2019.
    """
    n_agents = parents.shape[1]
    for generation, couples in enumerate(parents.tolist()):
        # The id of agent 0 of a generation.
        generation_id = first_id + generation * n_agents
        parent_generation_id = generation_id - n_agents
        for agent, couple in enumerate(couples):
            distinct_parents = [parent for parent in dict.fromkeys(couple) if parent >= 0]
            parent_ids = [str(parent_generation_id + parent) for parent in distinct_parents]
            ancestors = ",".join(parent_ids) or "none"
            yield f'{generation_id + agent},"[{ancestors}]",{generation},{generation + 1}'


ASSAY: Final = Assay(
    name="descent",
    question="What is the effective number of ancestors in the first generation?",
    variables={
        "common_ancestor_age": Variable(
            ("run", "generation"),
            np.float32,
            "generations",
            "generations since the last common ancestor of all agents; NaN without one",
        ),
        "effective_ancestors": Variable(
            ("run", "generation"),
            np.float32,
            "agents",
            "effective number of founders: 1 / sum of squared shares in the gene pool",
        ),
    },
    plan=plan_assay,
    measure=measure,
    # The assay only reads stored values, so it is always applicable.
    obstacles=(),
    is_default=True,
    work_bytes=estimate_memory,
)
