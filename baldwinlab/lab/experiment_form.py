"""What a form of an experiment must know: its fields, what is wrong with what it says, and how that would look."""

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
from baldwinlab.lab.query import body, whole_number
from baldwinlab.lab.schema import schema_of
from baldwinlab.models.miniworld.appearance import look
from baldwinlab.models.miniworld.description import about
from baldwinlab.simulation.simulate import check_seed

UNKNOWN = ": there is no such field"  # how the sentence about one goes on after its path


def routes(lab: Lab) -> list[BaseRoute]:
    async def check(request: Request) -> JSONResponse:
        order = await body(request)
        errors = faults(order.get("experiment")) or _beyond(order)
        return JSONResponse(
            {"errors": errors, "note": "" if errors else await run_in_threadpool(_note, order)}
        )

    async def schema(request: Request) -> JSONResponse:
        return JSONResponse(form_of((await body(request)).get("experiment")))

    async def preview(request: Request) -> JSONResponse:
        experiment = validate((await body(request)).get("experiment", {}))
        return JSONResponse(
            appearance_of(experiment)
            if isinstance(experiment, Experiment)
            else {"world": None, "look": None}
        )

    endpoints = {"validate": check, "schema": schema, "look": preview}
    return [
        Route(f"/api/{name}", endpoint, methods=["POST"]) for name, endpoint in endpoints.items()
    ]


def appearance_of(experiment: Experiment) -> dict[str, Any]:
    """The world of an experiment, and what one sees of it, as the header of a recording has it."""
    return {
        "world": experiment.world.model_dump(mode="json"),
        "look": look(experiment).to_dict(),
        "about": [topic._asdict() for topic in about(experiment)],
    }


def form_of(tree: Any) -> dict[str, Any]:
    """The fields that an experiment has, with all that it chooses, as a JSON schema, and the experiment, complete.

    Tables that belong to what is not chosen are left out of it, and those of what is chosen have their defaults. Where it is
    wrong, it comes back as it is, with the faults and the fields that every experiment has.
    """
    try:
        experiment = completed(tree)
    except ExperimentError:
        return {"schema": schema_of(Experiment), "experiment": tree, "errors": faults(tree)}
    return {"schema": schema_of(type(experiment)), "experiment": experiment.to_dict(), "errors": []}


def completed(tree: Any) -> BaseExperiment:
    """The experiment that a tree means without the tables that it cannot have. Raises ExperimentError for any other fault."""
    while True:
        try:
            made: BaseExperiment = validate(tree)
            return made
        except ExperimentError as error:
            paths = [
                line.partition(UNKNOWN)[0] for line in str(error).splitlines() if UNKNOWN in line
            ]
            pruned = tree
            for path in paths:
                pruned = _without_table(pruned, path.split("."))
            if pruned == tree:
                raise
            tree = pruned


def _without_table(tree: Any, path: list[str]) -> Any:
    """A copy of a tree that lacks the table at a path, if one is there."""
    if not isinstance(tree, dict) or path[0] not in tree:
        return tree
    below = tree[path[0]]
    if len(path) > 1:
        return tree | {path[0]: _without_table(below, path[1:])}
    return {
        name: value
        for name, value in tree.items()
        if name != path[0] or not isinstance(below, dict)
    }


def faults(tree: Any) -> list[dict[str, str]]:
    """What is wrong with an experiment, in the config's own sentences, each with the path of the field that it is about.

    The path is empty for what is about the whole.
    """
    try:
        validate(tree)
    except ExperimentError as error:
        return [{"path": _path_in(line, tree), "message": line} for line in str(error).splitlines()]
    return []


def _beyond(order: dict[str, Any]) -> list[dict[str, str]]:
    """Why a live run of an experiment in which nothing is wrong cannot be, as `faults` says it: its size, its seed."""
    if "runs" not in order:
        return []
    try:
        runs, seed = whole_number(order, "runs", 1), whole_number(order, "seed", 0)
        check_seed(seed)
        check_size(validate(order["experiment"]), runs)
    except ValueError as error:
        return [{"path": _path_in(str(error), order), "message": str(error)}]
    return []


def _note(order: dict[str, Any]) -> str:
    """Whether the runs of a live run are too few to compare it with another one; "" where they are not."""
    from baldwinlab.analysis.statistics.contrasts import (
        planned_designs,
    )  # here, because SciPy's statistics take a while to load
    from baldwinlab.analysis.statistics.sample_sizes import describe_too_few

    if "runs" not in order:
        return ""
    sentence = describe_too_few(
        planned_designs({"this": Factors(), "another": Factors()}, whole_number(order, "runs", 1))
    )
    return f"To compare two conditions: {sentence[0].lower()}{sentence[1:]}" if sentence else ""


def _path_in(sentence: str, tree: Any) -> str:
    """The path that a sentence begins with, or nothing where its first word is none."""
    path = sentence.split(" ", 1)[0].removesuffix(":")
    place = tree
    for step in path.split("."):
        if isinstance(place, list) and step.isdecimal() and int(step) < len(place):
            place = place[int(step)]
        elif isinstance(place, dict) and step in place:
            place = place[step]
        else:
            return ""
    return path
