"""Routes of the stored studies and their results."""

from __future__ import annotations

import json
from functools import partial
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import BaseRoute, Route

from baldwinlab import papers
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.files import quote_path
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.lab import Lab, MissingError
from baldwinlab.lab.concurrency import queue_content
from baldwinlab.lab.missing_parts import describe_missing_parts
from baldwinlab.lab.model_displays import read_alleles, read_views
from baldwinlab.lab.query import Query, read_text
from baldwinlab.lab.study_access import (
    find_condition,
    find_study,
    list_study_names,
    read_versions,
    require_inside,
)
from baldwinlab.studies.claims_file import CLAIMS_FILE, read_claims
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import design as sweeps


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    def studies(request: Request) -> JSONResponse:
        summaries = [summarize(lab, name) for name in list_study_names(lab.root)]
        return JSONResponse({"studies": summaries})

    def experiment(request: Request) -> JSONResponse:
        study = find_study(lab, read_text(request.query_params, "study"))
        condition = find_condition(study, read_text(request.query_params, "condition"))
        return JSONResponse(condition.to_dict())

    endpoints = {
        "studies": studies,
        "experiment": experiment,
        "results": queue_content(lab, lambda query: load_results(lab, read_text(query, "study"))),
        "typical": queue_content(lab, partial(load_typical_run, lab)),
    }
    return [Route(f"/api/{name}", endpoint) for name, endpoint in endpoints.items()]


def summarize(lab: Lab, name: str) -> dict[str, Any]:
    """Return the conditions and runs of a study, or why it cannot be read.

    `missing` says why lifetimes of the study cannot be simulated, and how they can.
    """
    try:
        return _summarize_readable(lab, find_study(lab, name), name)
    except BaldwinLabError as error:
        # A single study does not hide the others.
        return {"id": name, "seed": None, "modified": 0, "conditions": [], "problem": str(error)}


def _summarize_readable(lab: Lab, study: StudyStore, name: str) -> dict[str, Any]:
    main_condition, question = _read_paper(study)
    titles = sweeps.name_points(study)
    missing = describe_missing_parts(lab, study)
    conditions = [
        _summarize_condition(study, experiment, has_parts=not missing)
        | {"title": titles[experiment.name], "shown": experiment.name == main_condition}
        for experiment in study.experiments.values()
    ]
    return {
        "id": name,
        # The argument of commands in the working directory of the server.
        "argument": quote_path(study.directory),
        "seed": study.seed,
        "paper": study.paper,
        "question": question,
        # The page opens the study with the newest run. In seconds.
        "modified": _find_last_change(study),
        "conditions": conditions,
        "report": (study.directory / "report.html").is_file(),
        "problem": None,
        "missing": missing,
    }


def _find_last_change(study: StudyStore) -> float:
    """Return when the newest run of a study was stored, in seconds; 0 without a run."""
    paths = (file.path for name in study.experiments for file in study.files(name))
    return max((path.stat().st_mtime for path in paths), default=0)


def _summarize_condition(
    study: StudyStore, experiment: BaseExperiment, has_parts: bool
) -> dict[str, Any]:
    views = read_views(experiment)
    return {
        "name": experiment.name,
        **study.factors[experiment.name]._asdict(),
        "runs": study.runs(experiment.name),
        "generations": experiment.evolution.generations,
        "learns": has_parts and experiment.learns,
        # Those of one world.
        "agents": experiment.agents_per_world
        if isinstance(experiment, Experiment)
        else experiment.population.size,
        # None for a model without a world.
        "steps": experiment.lifetime.steps if isinstance(experiment, Experiment) else None,
        "alleles": list(read_alleles(experiment)),
        "views": [
            {"name": name, "has_agent_choice": view.has_agent_choice}
            for name, view in views.items()
        ],
    }


def _read_paper(study: StudyStore) -> tuple[str, str]:
    """Return the condition of the paper's main figure, and the question of the paper.

    The page shows both first. They are "" without a paper.
    """
    try:
        paper = papers.load_stored_paper(study.directory, study.paper)
        question = paper.card.question if study.paper and paper.card else ""
        return paper.metadata.emergence, question
    except papers.PaperError:
        return "", ""


def load_typical_run(lab: Lab, query: Query) -> bytes:
    """Return the typical run of a condition, as JSON.

    Raise StudyError as `find_study`, and for a damaged record.
    """
    study = find_study(lab, read_text(query, "study"))
    condition = find_condition(study, read_text(query, "condition")).name
    versions = read_versions(lab.root, [file.path for file in study.files(condition)])
    if not versions:
        raise MissingError(f"{study.location} has no run of {condition}")

    def make() -> bytes:
        # This import takes time.
        from baldwinlab.analysis.statistics.fitness import typical_run

        run = typical_run(open_sample(study, [condition]), condition)
        return json.dumps({"run": run}).encode()

    return lab.cache.get(("typical", study.directory, condition, versions), make)


def load_results(lab: Lab, name: str) -> bytes:
    """Return the curves, final values and claims of a study, as JSON.

    A missing number is null. Results that are stored with the report are used if they are up to
    date. If the claims are not valid, `problem` contains the error.

    Raise StudyError as `find_study`, and for a damaged record.
    """
    # This import takes time.
    from baldwinlab.api.publish import lab_results, results_cache

    study = find_study(lab, name)
    record_paths = [file.path for condition in study.experiments for file in study.files(condition)]
    claims_path = study.directory / CLAIMS_FILE
    cache_path = study.directory / results_cache.CACHE_FILE
    sweep_path = study.directory / sweeps.SWEEP_FILE_NAME
    for path in (cache_path, sweep_path):
        require_inside(lab.root, path)
    # The results depend on these files only.
    versions = read_versions(lab.root, [*record_paths, claims_path])

    def make() -> bytes:
        results = results_cache.load_cached_results(study) or lab_results.compute_results(study)
        return json.dumps(results | _read_claims_or_error(study)).encode()

    return lab.cache.get(("results", study.directory, versions), make)


def _read_claims_or_error(study: StudyStore) -> dict[str, Any]:
    """Return the claims of a study, or the error if they are not valid."""
    try:
        return {"claims": read_claims(study), "problem": None}
    except StudyError as error:
        return {"claims": [], "problem": str(error)}
