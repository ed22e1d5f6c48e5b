"""The stored studies, their results, and the presets."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from baldwinlab import papers
from baldwinlab.core.suggestions import suggest
from baldwinlab.experiment import BaseExperiment, Experiment, registry
from baldwinlab.experiment.factors import Factors
from baldwinlab.lab import Lab, MissingError
from baldwinlab.lab.concurrency import QueuedResponse
from baldwinlab.lab.query import text
from baldwinlab.lab.schema import schema_of
from baldwinlab.papers import presets
from baldwinlab.parts import View
from baldwinlab.studies.claims_file import CLAIMS, read_claims
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import design as sweeps


def routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    def studies(request: Request) -> JSONResponse:
        summaries = [summarize(lab, name) for name in study_names(lab.root)]
        return JSONResponse({"studies": summaries})

    def experiment(request: Request) -> JSONResponse:
        study = find_study(lab, text(request.query_params, "study"))
        return JSONResponse(
            find_condition(study, text(request.query_params, "condition")).to_dict()
        )

    async def all_results(request: Request) -> Response:
        name = text(request.query_params, "study")
        return QueuedResponse(
            lab, lambda: Response(results_of(lab, name), media_type="application/json")
        )

    async def typical(request: Request) -> Response:
        name = text(request.query_params, "study")
        condition = text(request.query_params, "condition")
        return QueuedResponse(
            lab,
            lambda: Response(typical_run_of(lab, name, condition), media_type="application/json"),
        )

    def all_presets(request: Request) -> JSONResponse:
        return JSONResponse(
            {"presets": _presets(), "default": _default_preset(), "schema": schema_of(Experiment)}
        )

    def preset(request: Request) -> JSONResponse:
        return JSONResponse(load_preset(text(request.query_params, "name")).to_dict())

    endpoints = {
        "studies": studies,
        "experiment": experiment,
        "results": all_results,
        "typical": typical,
        "presets": all_presets,
        "preset": preset,
    }
    return [Route(f"/api/{name}", endpoint) for name, endpoint in endpoints.items()]


def study_names(root: Path) -> Iterator[str]:
    """Yield the paths of all studies in a folder, relative to it. "." is the folder itself.

    Links to folders are not followed.
    """
    for folder, subfolders, files in os.walk(root):
        if "study.toml" in files:
            yield Path(folder).relative_to(root).as_posix()
        subfolders[:] = sorted(
            name for name in subfolders if name != "runs" and not name.startswith(".")
        )


def find_study(lab: Lab, name: str) -> StudyStore:
    """Return the study of this name.

    Raise MissingError if it does not exist, and StudyError if it is outside the served folder or
    cannot be read.
    """
    path = lab.root / name / "study.toml"
    try:
        modified = path.stat().st_mtime_ns
    except (OSError, ValueError):
        # ValueError: the name is not valid for a file.
        raise MissingError(f"there is no study {name!r} in {lab.root}") from None
    for part in (path.parent, path, path.parent / "runs"):
        require_inside(lab.root, part)
    return _open_study(lab.root, path.parent.resolve(), modified)


@lru_cache(maxsize=16)
def _open_study(root: Path, directory: Path, modified: int) -> StudyStore:
    """Open a study and cache it until `study.toml` is modified.

    A study of thousands of conditions takes seconds to open.
    """
    try:
        study = StudyStore(directory)
    except (TypeError, ValueError) as error:
        # The file is valid TOML, but not a study.
        raise StudyError(f"{directory} cannot be read: {error}") from None
    for name in study.experiments:
        require_inside(root, directory / "runs" / name)
    return study


def require_inside(root: Path, path: Path) -> None:
    """Raise StudyError if a path, after resolving links, is outside the served folder."""
    if not path.resolve().is_relative_to(root):
        raise StudyError(f"{path} is outside {root}, the folder of this lab")


def find_condition(study: StudyStore, name: str) -> Experiment:
    """Return a condition of a study. Raise MissingError if it does not exist."""
    try:
        return study.experiment(name)
    except StudyError as error:
        raise MissingError(str(error)) from None


def require_run(lab: Lab, study: StudyStore, name: str, run: int) -> None:
    """Raise MissingError if a run is not stored."""
    runs = study.runs(name)
    if run not in runs:
        stored = (
            f"{len(runs)} runs are stored, from {runs[0]} to {runs[-1]}"
            if runs
            else "no run is stored yet"
        )
        raise MissingError(f"{study.directory} has no run {run} of {name}; {stored}")
    require_inside(lab.root, study.path(name, run))


def summarize(lab: Lab, name: str) -> dict[str, Any]:
    """Return the conditions and runs of a study, or why it cannot be read."""
    try:
        return _summarize(find_study(lab, name), name)
    except StudyError as error:
        return {"id": name, "seed": None, "conditions": [], "problem": str(error)}


def _summarize(study: StudyStore, name: str) -> dict[str, Any]:
    main_condition = _main_condition(study)
    conditions = [
        {
            "name": experiment.name,
            "shown": experiment.name == main_condition,
            **study.factors[experiment.name]._asdict(),
            "runs": study.runs(experiment.name),
            "generations": experiment.evolution.generations,
            "agents": experiment.population.size,
            # None for a model without a world.
            "steps": experiment.lifetime.steps if isinstance(experiment, Experiment) else None,
            "alleles": list(alleles_of(experiment)),
            "views": [
                {"name": name, "of_an_agent": view.of_an_agent}
                for name, view in views_of(experiment).items()
            ],
        }
        for experiment in study.experiments.values()
    ]
    report = (study.directory / "report.html").is_file()
    return {
        "id": name,
        "seed": study.seed,
        "paper": study.paper,
        "conditions": conditions,
        "report": report,
        "problem": None,
    }


def alleles_of(experiment: BaseExperiment) -> Mapping[str, float]:
    """Return the alleles that the model declares. They are empty if the model is not loaded."""
    model = experiment.loaded_model
    return model.alleles if model else {}


def views_of(experiment: BaseExperiment) -> Mapping[str, View]:
    """Return the views that the model declares. They are empty if the model is not loaded."""
    model = experiment.loaded_model
    return model.views if model else {}


def describe_model(experiment: BaseExperiment) -> str:
    """Return the docstring of a model without a world, on one line."""
    return " ".join((type(experiment.of_model).__doc__ or "").split())


def is_viewable(experiment: BaseExperiment) -> bool:
    """Return whether the World tab can show a condition: a world, alleles, or views."""
    return isinstance(experiment, Experiment) or bool(
        alleles_of(experiment) or views_of(experiment)
    )


def _main_condition(study: StudyStore) -> str:
    """Return the condition that a page shows first: that of the paper's main figure, or ""."""
    try:
        return papers.of_study(study.directory, study.paper).metadata.emergence
    except papers.PaperError:
        return ""


def _default_preset() -> str:
    """Return the preset of the first live run: the main condition of the first paper, first map."""
    paper = papers.load()
    return f"{paper.factors()[paper.metadata.emergence].learner}/{paper.names('maps')[0]}"


def _presets() -> list[dict[str, Any]]:
    """Return the presets of all papers, and all third-party models with their defaults."""
    built_in = [
        {
            "name": name,
            "learner": factors.learner,
            "map": factors.map,
            "description": "; ".join(_descriptions(factors)),
            "shown": name == papers.load().metadata.emergence,
            "world": _world_size(presets.load(name)),
        }
        for name, factors in presets.factors().items()
    ]
    models = [
        (name, part) for (kind, name), part in registry.custom_parts().items() if kind == "model"
    ]
    return built_in + [
        {
            "name": name,
            "learner": name,
            "map": "",
            "description": (part.__doc__ or "").split("\n")[0],
            "world": None,
        }
        for name, part in models
    ]


def _learner_kind(learner: str) -> str:
    return "conditions" if learner in presets.names("conditions") else "controls"


def _descriptions(factors: Factors) -> Iterator[str]:
    yield presets.describe(_learner_kind(factors.learner), factors.learner)
    if factors.map:
        yield presets.describe("maps", factors.map)


def _world_size(experiment: BaseExperiment) -> dict[str, int] | None:
    """Return the size of the world's recordings, or None if the model has no world."""
    if not isinstance(experiment, Experiment):
        return None
    return {
        "generations": experiment.evolution.generations,
        "agents": experiment.population.size,
        "steps": experiment.lifetime.steps,
    }


def load_preset(name: str) -> Experiment:
    """Return a listed preset. Raise MissingError for another name.

    `presets.load` would also read a file of this name.
    """
    available = [preset["name"] for preset in _presets()]
    if name not in available:
        raise MissingError(f"there is no preset {name!r}{suggest(name, available)}")
    return presets.load(name)


def typical_run_of(lab: Lab, name: str, condition: str) -> bytes:
    """Return the typical run of a condition, as JSON.

    Raise StudyError as `find_study`, and for a damaged record.
    """
    study = find_study(lab, name)
    find_condition(study, condition)
    paths = [study.path(condition, run) for run in study.runs(condition)]
    if not paths:
        raise MissingError(f"{study.directory} has no run of {condition}")
    for path in paths:
        require_inside(lab.root, path)
    versions = tuple(path.stat().st_mtime_ns for path in paths)

    def make() -> bytes:
        # This import takes time.
        from baldwinlab.analysis.statistics.fitness import typical_run

        run = typical_run(open_conditions(study, [condition]), condition)
        return json.dumps({"run": run}).encode()

    return lab.cache.get(("typical", study.directory, condition, versions), make)


def results_of(lab: Lab, name: str) -> bytes:
    """Return the curves, final values and claims of a study, as JSON.

    A missing number is null. The results are those stored with the report if they are up to date.
    If the claims are not valid, `problem` contains the error.

    Raise StudyError as `find_study`, and for a damaged record.
    """
    # This import takes time.
    from baldwinlab.api.publish import lab_results

    study = find_study(lab, name)
    records = [
        study.path(condition, run)
        for condition in study.experiments
        for run in study.runs(condition)
    ]
    claims = study.directory / CLAIMS
    derived = (study.directory / lab_results.FILE, study.directory / sweeps.FILE)
    for path in (*records, claims, *derived):
        require_inside(lab.root, path)
    files = (*records, claims)
    versions = tuple((path, path.stat().st_mtime_ns) for path in files if path.exists())

    def make() -> bytes:
        results = lab_results.load_cached_results(study) or lab_results.compute_results(study)
        return json.dumps(results | _claims_of(study)).encode()

    return lab.cache.get(("results", study.directory, versions), make)


def _claims_of(study: StudyStore) -> dict[str, Any]:
    """Return the claims of a study, or the error if they are not valid."""
    try:
        return {"claims": read_claims(study), "problem": None}
    except StudyError as error:
        return {"claims": [], "problem": str(error)}
