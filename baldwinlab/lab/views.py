"""The route of views, which models without a world declare. A view shows one generation."""

from __future__ import annotations

from functools import partial
from typing import Any

from starlette.routing import BaseRoute, Route

from baldwinlab.core.suggestions import did_you_mean
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import BaseExperiment
from baldwinlab.lab import Lab, MissingError, binary_frames, life_query, model_displays
from baldwinlab.lab.concurrency import CONTAINER, queue_content
from baldwinlab.lab.query import Query, read_number, read_text
from baldwinlab.lab.study_access import find_run
from baldwinlab.parts.views import GridView, MatrixView, View, ViewData, arrays_of
from baldwinlab.simulation.reevaluation import restore_genomes


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    return [Route("/api/view", queue_content(lab, partial(pack_view, lab), CONTAINER))]


def pack_view(lab: Lab, query: Query) -> bytes:
    """Return the container with the requested view of a generation of a stored run.

    A view of an agent shows the requested agent, or the fittest one.

    Raise StudyError and ValueError as `find_life`, MissingError for an unknown view or agent, and
    ValueError for data that is inconsistent or too large for one response.
    """
    study, experiment, run = find_run(lab, query)
    study.require_parts(experiment.name)
    view = _find_view(experiment, read_text(query, "view"))
    generation = read_number(query, "generation")
    requested_agent = read_number(query, "agent", 0) if "agent" in query else None
    life_query.require_generation(experiment, generation)
    if requested_agent is not None:
        life_query.require_agent(experiment, requested_agent)

    def make() -> bytes:
        record = study.record(experiment.name, run)
        genomes = restore_genomes(experiment, record, generation)
        fittest_agent = int(record.energy.values[generation].argmax())
        agent = fittest_agent if requested_agent is None else requested_agent
        generation_key = GenerationKey(study.seed, run, generation)
        data = view.make_data(experiment.model_part, generation_key, genomes, agent)
        header = {
            "view_description": view.description,
            "agent": agent if view.has_agent_choice else None,
            "description": model_displays.describe_model(experiment),
        }
        return _pack_data(data, header)

    cache_key = ("view", experiment, study.seed, run, generation, query["view"], requested_agent)
    return lab.cache.get(cache_key, make)


def _find_view(experiment: BaseExperiment, name: str) -> View:
    """Return the view of this name. Raise MissingError if the model does not declare it."""
    views = model_displays.read_views(experiment)
    if name not in views:
        hint = "; it declares no views"
        if views:
            hint = f"{did_you_mean(name, views)}; its views are {', '.join(views)}"
        raise MissingError(
            f"{experiment.name}: the model {experiment.model} has no view {name!r}{hint}"
        )
    return views[name]


def _pack_data(data: ViewData, header: dict[str, Any]) -> bytes:
    arrays = arrays_of(data)
    n_bytes = sum(array.nbytes for array in arrays.values())
    if n_bytes > life_query.MAX_RESPONSE_BYTES:
        raise ValueError(
            f"this view has {n_bytes:,} bytes; one response can contain"
            f" {life_query.MAX_RESPONSE_BYTES:,} bytes"
        )
    return binary_frames.pack(header | _make_kind_header(data), arrays)


def _make_kind_header(data: ViewData) -> dict[str, Any]:
    if isinstance(data, MatrixView):
        return {
            "kind": "matrix",
            "rows": list(data.rows),
            "columns": list(data.columns),
            "value_label": data.value_label,
        }
    if isinstance(data, GridView):
        return {
            "kind": "grid",
            "cell_colors": dict(data.cell_colors),
            "visit_label": data.visit_label,
        }
    return {
        "kind": "path",
        "names": list(data.lines),
        "step_label": data.step_label,
        "value_label": data.value_label,
    }
