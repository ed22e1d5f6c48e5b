"""What is recorded of one run: how its agents did in every generation, and from whom one of them descends."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from baldwinlab.lab import Lab, life_query, studies
from baldwinlab.lab.concurrency import InTurn
from baldwinlab.lab.life_query import Life
from baldwinlab.lab.query import Query, number, text
from baldwinlab.simulation.simulate import live_batch
from baldwinlab.studies.assays.descent import Parents, ancestors, fitter_line

Counts = npt.NDArray[np.int32]


def routes(lab: Lab) -> list[BaseRoute]:
    async def run(request: Request) -> Response:
        return InTurn(lab, lambda: JSONResponse(curve(lab, request.query_params)))

    async def descent(request: Request) -> Response:
        query = request.query_params
        life = await run_in_threadpool(life_query.find, lab, query)
        life_query.require_agent(life.experiment, agent := number(query, "agent"))
        return InTurn(
            lab,
            lambda: JSONResponse(
                line_of_ancestors(life.moment.generation, agent, *_recorded(lab, query, life))
            ),
        )

    return [Route("/api/run", run), Route("/api/ancestors", descent)]


def curve(lab: Lab, query: Query) -> dict[str, Any]:
    """The best and the mean agent of every generation of a stored run, and the `measure` of that.

    Raises StudyError and ValueError as a request for a recording of it does.
    """
    from baldwinlab.analysis.statistics.fitness import gain

    study, name, run = (
        studies.find(lab, text(query, "study")),
        text(query, "condition"),
        number(query, "run"),
    )
    studies.condition(study, name)
    studies.require_run(lab, study, name, run)
    record = study.read(name, run, genomes=False)
    achieved = gain(record)
    measure = "food eaten" if "food_eaten" in record else "fitness"
    return {
        "measure": measure,
        "best": achieved.max("agent").values.tolist(),
        "mean": achieved.mean("agent").values.tolist(),
    }


def line_of_ancestors(
    generation: int, agent: int, parents: Parents, eaten: Counts
) -> dict[str, Any]:
    """From whom an agent descends, generation by generation from the `first` one to its own.

    `agents` are the line of the fitter parents, with the agent itself at the end, and `others` the other parents along it, one
    fewer; of both, the food that they ate in their lives. `ancestors` counts from how many agents of each generation it descends,
    through both parents; `mean` is what all agents of each generation ate on average.
    """
    couples = fitter_line(parents, generation, agent)[::-1]
    line, others = [fitter for fitter, _ in couples] + [agent], [other for _, other in couples]
    first = generation - len(couples)
    return {
        "first": first,
        "agents": line,
        "eaten": eaten[range(first, generation + 1), line].tolist(),
        "others": others,
        "eaten_of_others": eaten[range(first, generation), others].tolist(),
        "ancestors": [
            len(of_a_generation) for of_a_generation in ancestors(parents, generation, agent)
        ][::-1],
        "mean": eaten[first : generation + 1].mean(axis=1).tolist(),
    }


def _recorded(lab: Lab, query: Query, life: Life) -> tuple[Parents, Counts]:
    """Of a life's run, at least up to that life: the parents [generation, agent, 2], and the food eaten [generation, agent]."""
    experiment, (seed, run, generation) = life.experiment, life.moment
    if "study" in query:
        record = studies.find(lab, query["study"]).read(experiment.name, run, genomes=False)
        return record.parents.values, record.food_eaten.values
    if "live" in query:
        history = lab.live.run(query["live"]).history(run, generation)
    else:
        until_then = experiment.replace(
            evolution={"generations": generation + 1}, record={"genome_every": generation + 1}
        )
        (history,) = live_batch(until_then, seed, [run])
    return history.parents, history.of_agents("food_eaten")
