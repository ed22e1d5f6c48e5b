"""What the views that a model declares show of a generation of a stored run, for models that have no world to watch."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.core.suggestions import did_you_mean
from baldwinlab.evolution import Moment
from baldwinlab.experiment import BaseExperiment
from baldwinlab.lab import Lab, MissingError, binary_frames, life_query, studies
from baldwinlab.lab.concurrency import InTurn
from baldwinlab.lab.query import Query, number, text
from baldwinlab.parts.views import GridView, MatrixView, View, ViewData, arrays_of
from baldwinlab.simulation.reevaluation import stored_genome


def routes(lab: Lab) -> list[BaseRoute]:
    async def view(request: Request) -> Response:
        return InTurn(
            lab,
            lambda: Response(
                seen(lab, request.query_params), media_type="application/octet-stream"
            ),
        )

    return [Route("/api/view", view)]


def seen(lab: Lab, query: Query) -> bytes:
    """The container of what a `view` shows of a generation of a stored run, or of an `agent` of it, the fittest unless given.

    Raises StudyError and ValueError as a request for a recording does, MissingError also for a view or an agent that is not, and
    ValueError for what does not fit together or into one answer.
    """
    study, name, run = (
        studies.find(lab, text(query, "study")),
        text(query, "condition"),
        number(query, "run"),
    )
    experiment = studies.condition(study, name)
    study.require_parts(name)
    view = _declared(experiment, text(query, "view"))
    generation, asked = (
        number(query, "generation"),
        number(query, "agent", 0) if "agent" in query else None,
    )
    life_query.require_generation(experiment, generation)
    life_query.require_agent(experiment, asked or 0)
    studies.require_run(lab, study, name, run)

    def make() -> bytes:
        record = study.record(name, run)
        agent = int(record.energy.values[generation].argmax()) if asked is None else asked
        genomes = stored_genome(experiment, record, generation)
        found = view.of(experiment.of_model, Moment(study.seed, run, generation), genomes, agent)
        header = {
            "meaning": view.meaning,
            "agent": agent if view.of_an_agent else None,
            "about": studies.about(experiment),
        }
        return _packed(found, header)

    key = ("view", experiment, study.seed, run, generation, query["view"], asked)
    return lab.answers.get(key, make)


def _declared(experiment: BaseExperiment, name: str) -> View:
    declared = studies.views_of(experiment)
    if name not in declared:
        known = (
            f"{did_you_mean(name, declared)}; it declares {', '.join(declared)}"
            if declared
            else ", and none at all"
        )
        raise MissingError(
            f"{experiment.name} is of the model {experiment.model}, which declares no view {name!r}{known}"
        )
    return declared[name]


def _packed(found: ViewData, header: dict[str, Any]) -> bytes:
    arrays = arrays_of(found)
    size = sum(array.nbytes for array in arrays.values())
    if size > life_query.MOST_BYTES:
        raise ValueError(
            f"this view has {size:,} bytes, more than one answer may hold; that is {life_query.MOST_BYTES:,}"
        )
    of_kind: dict[str, Any]
    if isinstance(found, MatrixView):
        of_kind = {
            "kind": "matrix",
            "rows": list(found.rows),
            "columns": list(found.columns),
            "value": found.value,
        }
    elif isinstance(found, GridView):
        of_kind = {"kind": "cells", "marks": dict(found.marks), "visits": found.visits}
    else:
        of_kind = {
            "kind": "walk",
            "names": list(found.lines),
            "step": found.step,
            "value": found.value,
        }
    return binary_frames.pack(header | of_kind, arrays)
