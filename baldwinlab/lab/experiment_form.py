"""The form of an experiment: its fields, its errors, and a preview of its world."""

from __future__ import annotations

from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import BaseRoute, Route

from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError, validate
from baldwinlab.experiment.factors import Factors
from baldwinlab.lab import Lab
from baldwinlab.lab.limits import check_size
from baldwinlab.lab.query import read_body, read_body_number
from baldwinlab.lab.schema import make_schema
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.description import list_topics
from baldwinlab.simulation.simulate import check_seed

# The text after the path in the error about an unknown field.
UNKNOWN_FIELD_MESSAGE = ": there is no such field"


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    async def check(request: Request) -> JSONResponse:
        order = await read_body(request)
        errors = find_errors(order.get("experiment")) or _find_limit_errors(order)
        note = "" if errors else await run_in_threadpool(_describe_sample_size, order)
        return JSONResponse({"errors": errors, "note": note})

    async def schema(request: Request) -> JSONResponse:
        return JSONResponse(make_form((await read_body(request)).get("experiment")))

    async def preview(request: Request) -> JSONResponse:
        experiment = validate((await read_body(request)).get("experiment", {}))
        if not isinstance(experiment, Experiment):
            return JSONResponse({"world": None, "appearance": None})
        return JSONResponse(describe_world(experiment))

    endpoints = {"validate": check, "schema": schema, "appearance": preview}
    return [
        Route(f"/api/{name}", endpoint, methods=["POST"]) for name, endpoint in endpoints.items()
    ]


def describe_world(experiment: Experiment) -> dict[str, Any]:
    """Return the world, its appearance and its description, as in the header of a recording."""
    return {
        "world": experiment.world.model_dump(mode="json"),
        "appearance": describe_appearance(experiment).to_dict(),
        "topics": [topic._asdict() for topic in list_topics(experiment)],
    }


def make_form(tree: Any) -> dict[str, Any]:
    """Return the JSON schema of an experiment with its parts, and the complete experiment.

    Tables of parts that the experiment does not use are left out. Other tables get their defaults.
    An invalid experiment is returned unchanged, with its errors and the schema of `Experiment`.
    """
    try:
        experiment = complete_experiment(tree)
    except ExperimentError:
        return {"schema": make_schema(Experiment), "experiment": tree, "errors": find_errors(tree)}
    return {
        "schema": make_schema(type(experiment)),
        "experiment": experiment.to_dict(),
        "errors": [],
    }


def complete_experiment(tree: Any) -> BaseExperiment:
    """Return the experiment of a tree, without the tables of parts that it does not use.

    Raise ExperimentError for other errors.
    """
    while True:
        try:
            experiment: BaseExperiment = validate(tree)
            return experiment
        except ExperimentError as error:
            lines = str(error).splitlines()
            paths = [
                line.partition(UNKNOWN_FIELD_MESSAGE)[0]
                for line in lines
                if UNKNOWN_FIELD_MESSAGE in line
            ]
            pruned = tree
            for path in paths:
                pruned = _remove_table(pruned, path.split("."))
            if pruned == tree:
                raise
            tree = pruned


def _remove_table(tree: Any, path: list[str]) -> Any:
    """Return a copy of a tree without the table at a path."""
    if not isinstance(tree, dict) or path[0] not in tree:
        return tree
    child = tree[path[0]]
    if len(path) > 1:
        return tree | {path[0]: _remove_table(child, path[1:])}
    if not isinstance(child, dict):
        return dict(tree)
    return {name: value for name, value in tree.items() if name != path[0]}


def find_errors(tree: Any) -> list[dict[str, str]]:
    """Return the errors of an experiment, each with the path of its field and a message.

    The path is empty if the error is about the complete experiment.
    """
    try:
        validate(tree)
    except ExperimentError as error:
        return [
            {"path": _find_error_path(line, tree), "message": line}
            for line in str(error).splitlines()
        ]
    return []


def _find_limit_errors(order: dict[str, Any]) -> list[dict[str, str]]:
    """Return why a valid experiment cannot be a live run: its size or its seed."""
    if "runs" not in order:
        return []
    try:
        runs = read_body_number(order, "runs", 1)
        check_seed(read_body_number(order, "seed", 0))
        check_size(validate(order["experiment"]), runs)
    except ValueError as error:
        return [{"path": _find_error_path(str(error), order), "message": str(error)}]
    return []


def _describe_sample_size(order: dict[str, Any]) -> str:
    """Return a note if there are too few runs to compare two conditions, else ""."""
    # This import of SciPy's statistics takes time.
    from baldwinlab.analysis.statistics.contrasts import planned_tests
    from baldwinlab.analysis.statistics.sample_sizes import describe_too_few

    if "runs" not in order:
        return ""
    conditions = {"first": Factors(), "second": Factors()}
    note = describe_too_few(planned_tests(conditions, read_body_number(order, "runs", 1)))
    return f"To compare two conditions: {note[0].lower()}{note[1:]}" if note else ""


def _find_error_path(message: str, tree: Any) -> str:
    """Return the path at the beginning of an error message, or ""."""
    path = message.split(" ", 1)[0].removesuffix(":")
    node = tree
    for step in path.split("."):
        if isinstance(node, list) and step.isdecimal() and int(step) < len(node):
            node = node[int(step)]
        elif isinstance(node, dict) and step in node:
            node = node[step]
        else:
            return ""
    return path
