"""The history of one run: fitness in each generation, and the relatives of an agent."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.lab import Lab, Query, read_number
from baldwinlab.lab.sources import life_query, studies
from baldwinlab.lab.sources.life_query import Life
from baldwinlab.simulation.replay import require_simulated
from baldwinlab.studies.assays.descent import (
    Parents,
    list_ancestors,
    list_children,
    trace_fitter_parents,
)

# Number of items that each agent ate, [generation, agent].
Counts = npt.NDArray[np.int32]
# A tree shows at most this number of generations before the generation of the agent.
MAX_DEPTH: Final = 4
# The number of ancestors of an agent in the earliest generation of a tree, at most.
MAX_AGENTS_PER_GENERATION: Final = 2**MAX_DEPTH


def load_ancestors(lab: Lab, query: Query) -> dict[str, Any]:
    """Return the line of an agent's fitter parents."""
    return trace_ancestor_line(*_load_descent(lab, query))


def load_lineage(lab: Lab, query: Query) -> dict[str, Any]:
    """Return the lineage tree of an agent."""
    return make_tree(*_load_descent(lab, query))


def _load_descent(lab: Lab, query: Query) -> tuple[int, int, Parents, Counts]:
    """Return the generation and the index of an agent, then the result of `load_history`."""
    life = life_query.find_life(lab, query)
    agent = read_number(query, "agent")
    life_query.require_agent(life.experiment, agent)
    return life.key.generation, agent, *load_history(lab, query, life)


def load_fitness_curve(lab: Lab, query: Query) -> dict[str, Any]:
    """Return `best` and `mean`, the fitness in each generation of a stored run [generation].

    The entry `measure` is the name of the values: "food eaten" or "fitness".
    """
    # This import takes time.
    from baldwinlab.analysis.statistics.fitness import gain

    study, experiment, run = studies.find_run(lab, query)
    record = study.read(experiment.name, run, genomes=False)
    fitness = gain(record)
    return {
        "measure": "food eaten" if "food_eaten" in record else "fitness",
        "best": fitness.max("agent").values.tolist(),
        "mean": fitness.mean("agent").values.tolist(),
    }


def trace_ancestor_line(
    generation: int, agent: int, parents: Parents, eaten: Counts
) -> dict[str, Any]:
    """Return the line of an agent's fitter parents, back to the first recorded generation.

    `parents`: [generation, agent, 2]. Each list of the result begins with the generation `first`.
    `agents` is the line, and `partners` the other parents. `ancestors` counts all ancestors, and
    `mean` is the mean number of items of all agents.
    """
    # The functions of descent go back in time, and the lists of the page go forward.
    couples = trace_fitter_parents(parents, generation, agent)[::-1]
    ancestor_groups = list_ancestors(parents, generation, agent)[::-1]
    line = [fitter for fitter, _ in couples] + [agent]
    partners = [partner for _, partner in couples]
    first_generation = generation - len(couples)
    generations_of_line = range(first_generation, generation + 1)
    generations_of_partners = range(first_generation, generation)
    return {
        "first": first_generation,
        "agents": line,
        "eaten": eaten[generations_of_line, line].tolist(),
        "partners": partners,
        "eaten_by_partners": eaten[generations_of_partners, partners].tolist(),
        "ancestors": [len(group) for group in ancestor_groups],
        "mean": eaten[first_generation : generation + 1].mean(axis=1).tolist(),
    }


def load_history(lab: Lab, query: Query, life: Life) -> tuple[Parents, Counts]:
    """Return the parents [generation, agent, 2] and the eaten items [generation, agent] of a run.

    Both contain at least the generations up to that of `life`. Raises `RefusedError` if a stored
    run stopped before this generation.
    """
    experiment = life.experiment
    _, run, generation = life.key
    if "study" in query:
        study = studies.find_study(lab, query["study"])
        record = study.read(experiment.name, run, genomes=False)
        require_simulated(experiment, run, generation, record.sizes["generation"])
        return record.parents.values, record.food_eaten.values
    if "live" in query:
        history = lab.live.find_run(query["live"]).find_history(run, generation)
    else:
        history = life_query.simulate_until(experiment, life.key)
    return history.parents, history.recorded_values("food_eaten")


def make_tree(generation: int, agent: int, parents: Parents, eaten: Counts) -> dict[str, Any]:
    """Return the lineage tree of an agent: ancestors, siblings and children.

    `parents`: [generation, agent, 2]. The tree has these entries:

    - rows: for each generation, its index, its agents, and the number of items that each agent
      ate. The row of the agent begins with the agent. The siblings follow: agents that share a
      parent with it.
    - links: [generation of the child, child, parent] for each link between two rows.
    - omitted: the number of siblings and children that are left out.
    """
    ancestors = list_ancestors(parents, generation, agent)[: MAX_DEPTH + 1]
    agents_by_generation = {generation - age: group.tolist() for age, group in enumerate(ancestors)}
    siblings = _list_siblings(parents[generation], agent)
    agents_by_generation[generation] = [agent, *siblings[: MAX_AGENTS_PER_GENERATION - 1]]
    children = list[int]()
    if generation + 1 < len(parents):
        children = list_children(parents[generation + 1], agent)
        agents_by_generation[generation + 1] = children[:MAX_AGENTS_PER_GENERATION]
    n_shown = sum(len(agents_by_generation.get(row, [])) for row in (generation, generation + 1))
    links = [
        [row, child, parent]
        for row, agents in agents_by_generation.items()
        for child in agents
        for parent in np.unique(parents[row, child]).tolist()
        if parent in agents_by_generation.get(row - 1, [])
    ]
    return {
        "rows": [
            {"generation": row, "agents": agents, "eaten": eaten[row, agents].tolist()}
            for row, agents in sorted(agents_by_generation.items())
            if agents
        ],
        "links": links,
        "omitted": 1 + len(siblings) + len(children) - n_shown,
    }


def _list_siblings(parents: Parents, agent: int) -> list[int]:
    """Return the agents that share a parent with an agent. Those with both parents come first."""
    # A negative index means that an agent has no parent.
    if parents[agent].min() < 0:
        return []
    # [agent]: number of shared parents, 0 to 2. The stable sort keeps the order of equal agents.
    n_shared = np.isin(parents, parents[agent]).sum(axis=1)
    n_shared[agent] = 0
    order = np.argsort(-n_shared, kind="stable")
    siblings: list[int] = order[n_shared[order] > 0].tolist()
    return siblings
