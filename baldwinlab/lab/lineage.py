"""The lineage tree of an agent: its ancestors, siblings and children, with all links."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from baldwinlab.lab import Lab, life_query
from baldwinlab.lab.concurrency import QueuedResponse
from baldwinlab.lab.history import Counts, load_history
from baldwinlab.lab.query import read_number
from baldwinlab.studies.assays.descent import Parents, list_ancestors

# The number of generations before that of the agent.
MAX_DEPTH: Final = 4
# All ancestors of an agent at the largest depth.
MAX_AGENTS_PER_GENERATION: Final = 2**MAX_DEPTH


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    async def lineage(request: Request) -> Response:
        query = request.query_params
        life = await run_in_threadpool(life_query.find_life, lab, query)
        agent = read_number(query, "agent")
        life_query.require_agent(life.experiment, agent)

        def respond() -> Response:
            parents, eaten = load_history(lab, query, life)
            return JSONResponse(make_tree(life.key.generation, agent, parents, eaten))

        return QueuedResponse(lab, respond)

    return [Route("/api/lineage", lineage)]


def make_tree(generation: int, agent: int, parents: Parents, eaten: Counts) -> dict[str, Any]:
    """Return the lineage tree of an agent.

    `parents`: [generation, agent, 2]. `eaten`: the number of items that each agent ate [generation,
    agent].

    The tree has these entries:

    - rows: for each generation, its number, its agents and what they ate. The agent is the
      first one of its generation, and its siblings follow. They share a parent with it.
    - links: the generation, the child and the parent of each link between the rows.
    - omitted: the number of siblings and children that are left out.
    """
    ancestors = list_ancestors(parents, generation, agent)[: MAX_DEPTH + 1]
    agents_by_generation = {generation - age: group.tolist() for age, group in enumerate(ancestors)}
    siblings = _list_siblings(parents[generation], agent)
    agents_by_generation[generation] = [agent, *siblings[: MAX_AGENTS_PER_GENERATION - 1]]
    children = list[int]()
    if generation + 1 < len(parents):
        children = _list_children(parents[generation + 1], agent)
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
    """Return the agents that share a parent with an agent; those that share both come first."""
    if parents[agent].min() < 0:
        return []
    n_shared = np.isin(parents, parents[agent]).sum(axis=1)
    n_shared[agent] = 0
    order = np.argsort(-n_shared, kind="stable")
    siblings: list[int] = order[n_shared[order] > 0].tolist()
    return siblings


def _list_children(parents: Parents, agent: int) -> list[int]:
    children: list[int] = np.flatnonzero((parents == agent).any(axis=1)).tolist()
    return children
