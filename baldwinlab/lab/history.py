"""The history of one run: fitness in each generation, and the ancestors of an agent."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from baldwinlab.lab import Lab, life_query, study_access
from baldwinlab.lab.concurrency import QueuedResponse
from baldwinlab.lab.life_query import Life
from baldwinlab.lab.query import Query, read_number, read_text
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.assays.descent import Parents, list_ancestors, trace_fitter_parents

Counts = npt.NDArray[np.int32]


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    async def run(request: Request) -> Response:
        return QueuedResponse(
            lab, lambda: JSONResponse(load_fitness_curve(lab, request.query_params))
        )

    async def descent(request: Request) -> Response:
        query = request.query_params
        life = await run_in_threadpool(life_query.find_life, lab, query)
        agent = read_number(query, "agent")
        life_query.require_agent(life.experiment, agent)

        def respond() -> Response:
            parents, eaten = load_history(lab, query, life)
            return JSONResponse(trace_ancestor_line(life.key.generation, agent, parents, eaten))

        return QueuedResponse(lab, respond)

    return [Route("/api/run", run), Route("/api/ancestors", descent)]


def load_fitness_curve(lab: Lab, query: Query) -> dict[str, Any]:
    """Return the best and the mean fitness in each generation of a stored run.

    `measure` is the name of the fitness measure. Raise StudyError and ValueError as `find_life`.
    """
    # This import takes time.
    from baldwinlab.analysis.statistics.fitness import gain

    study = study_access.find_study(lab, read_text(query, "study"))
    name = read_text(query, "condition")
    run = read_number(query, "run")
    study_access.find_condition(study, name)
    study_access.require_run(lab, study, name, run)
    record = study.read(name, run, genomes=False)
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

    `parents`: [generation, agent, 2]. `eaten`: the number of items that each agent ate [generation,
    agent].
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
    """Return the parents and the eaten items of a run, at least up to a lifetime.

    The shapes are [generation, agent, 2] and [generation, agent].
    """
    experiment = life.experiment
    seed, run, generation = life.key
    if "study" in query:
        study = study_access.find_study(lab, query["study"])
        record = study.read(experiment.name, run, genomes=False)
        return record.parents.values, record.food_eaten.values
    if "live" in query:
        history = lab.live.find_run(query["live"]).find_history(run, generation)
    else:
        n_generations = generation + 1
        # The page needs no genomes, so the run saves as few as possible.
        shortened = experiment.replace(
            evolution={"generations": n_generations}, record={"genome_every": n_generations}
        )
        (history,) = simulate_histories(shortened, seed, runs=[run])
    return history.parents, history.recorded_values("food_eaten")
