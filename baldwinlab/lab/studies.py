"""Which studies there are, and what they hold, as the page asks for it."""

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
from baldwinlab.studies.claims_file import CLAIMS, claims_in
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import design as sweeps


def routes(lab: Lab) -> list[BaseRoute]:
    def studies(request: Request) -> JSONResponse:
        return JSONResponse({"studies": [summary(lab, name) for name in study_names(lab.root)]})

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
        name, condition = (text(request.query_params, key) for key in ("study", "condition"))
        return QueuedResponse(
            lab, lambda: Response(typical_of(lab, name, condition), media_type="application/json")
        )

    def all_presets(request: Request) -> JSONResponse:
        return JSONResponse(
            {"presets": _presets(), "default": _default(), "schema": schema_of(Experiment)}
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
    """The studies below a folder, each as its path from there; "." is the folder itself. Links to folders are not followed."""
    for folder, below, files in os.walk(root):
        if "study.toml" in files:
            yield Path(folder).relative_to(root).as_posix()
        below[:] = sorted(name for name in below if name != "runs" and not name.startswith("."))


def find_study(lab: Lab, name: str) -> StudyStore:
    """The study of that name. Raises MissingError where there is none, StudyError where it lies outside or cannot be read."""
    path = lab.root / name / "study.toml"
    try:
        written = path.stat().st_mtime_ns
    except (OSError, ValueError):  # ValueError: no file can have such a name
        raise MissingError(f"there is no study {name!r} in {lab.root}") from None
    for place in (path.parent, path, path.parent / "runs"):
        require_inside(lab.root, place)
    return _opened(lab.root, path.parent.resolve(), written)


@lru_cache(maxsize=16)
def _opened(root: Path, directory: Path, written: int) -> StudyStore:
    """A study of thousands of conditions takes seconds to open, and what it is never changes once `study.toml` is written."""
    try:
        study = StudyStore(directory)
    except (TypeError, ValueError) as error:  # TOML, but of other things than a study's
        raise StudyError(f"{directory} cannot be read: {error}") from None
    for name in study.experiments:
        require_inside(root, directory / "runs" / name)
    return study


def require_inside(root: Path, path: Path) -> None:
    """Raises StudyError where a path, its links followed, leads out of the folder that is served."""
    if not path.resolve().is_relative_to(root):
        raise StudyError(f"{path} lies outside of {root}, the folder that this lab shows")


def find_condition(study: StudyStore, name: str) -> Experiment:
    """Raises MissingError for a condition that the study has not."""
    try:
        return study.experiment(name)
    except StudyError as error:
        raise MissingError(str(error)) from None


def require_run(lab: Lab, study: StudyStore, name: str, run: int) -> None:
    """Raises MissingError where no such run is stored."""
    runs = study.runs(name)
    if run not in runs:
        stored = (
            f"stored are {len(runs)}, from {runs[0]} to {runs[-1]}"
            if runs
            else "none is stored yet"
        )
        raise MissingError(f"{study.directory} has no run {run} of {name}; {stored}")
    require_inside(lab.root, study.path(name, run))


def summary(lab: Lab, name: str) -> dict[str, Any]:
    """What the page lists of a study: its conditions and their runs, or why it cannot be read."""
    try:
        return _summary(find_study(lab, name), name)
    except StudyError as error:
        return {"id": name, "seed": None, "conditions": [], "problem": str(error)}


def _summary(study: StudyStore, name: str) -> dict[str, Any]:
    shown = _shown(study)
    conditions = [
        {
            "name": experiment.name,
            "shown": experiment.name == shown,
            **study.factors[experiment.name]._asdict(),
            "runs": study.runs(experiment.name),
            "generations": experiment.evolution.generations,
            "agents": experiment.population.size,
            "steps": experiment.lifetime.steps
            if isinstance(experiment, Experiment)
            else None,  # of a life that can be watched
            "alleles": list(
                alleles_of(experiment)
            ),  # of genomes that can be looked at locus by locus
            "views": [
                {"name": view, "of_an_agent": of.of_an_agent}
                for view, of in views_of(experiment).items()
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
    """The alleles of a condition's genomes, as its model declares them: none where it does not, or is not here."""
    model = experiment.loaded_model
    return model.alleles if model else {}


def views_of(experiment: BaseExperiment) -> Mapping[str, View]:
    """The views that a condition's model declares: none where it does not, or is not here."""
    model = experiment.loaded_model
    return model.views if model else {}


def describe_model(experiment: BaseExperiment) -> str:
    """What a model without a world says of itself."""
    return " ".join((type(experiment.of_model).__doc__ or "").split())


def is_viewable(experiment: BaseExperiment) -> bool:
    """Whether the World tab has something to show of a condition: a world, the alleles of its genomes, or a view."""
    return isinstance(experiment, Experiment) or bool(
        alleles_of(experiment) or views_of(experiment)
    )


def _shown(study: StudyStore) -> str:
    """The condition that a page begins with: the one that the study's paper shows, if it has one."""
    try:
        return papers.of_study(study.directory, study.paper).about.emergence
    except papers.PaperError:
        return ""


def _default() -> str:
    """What a live run is unless another preset is chosen: what the first paper shows, on its first map."""
    paper = papers.load()
    return f"{paper.factors()[paper.about.emergence].learner}/{paper.names('maps')[0]}"


def _presets() -> list[dict[str, Any]]:
    """Those of the papers, and the models that are parts, each as it is by default."""
    built_in = [
        {
            "name": name,
            "learner": of.learner,
            "map": of.map,
            "description": "; ".join(_described(of)),
            "shown": name == papers.load().about.emergence,
            "world": _length(presets.load(name)),  # which can be watched
        }
        for name, of in presets.factors().items()
    ]
    models = [(name, part) for (kind, name), part in registry.foreign().items() if kind == "model"]
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


def _kind(learner: str) -> str:
    return "conditions" if learner in presets.names("conditions") else "controls"


def _described(of: Factors) -> Iterator[str]:
    yield presets.describe(_kind(of.learner), of.learner)
    if of.map:
        yield presets.describe("maps", of.map)


def _length(experiment: BaseExperiment) -> dict[str, int] | None:
    """How much there is to watch; None where there is nothing."""
    if not isinstance(experiment, Experiment):
        return None
    agents, steps = experiment.population.size, experiment.lifetime.steps
    return {"generations": experiment.evolution.generations, "agents": agents, "steps": steps}


def load_preset(name: str) -> Experiment:
    """Raises MissingError for a name that is not listed; also for that of a file, which `presets.load` would read."""
    known = [preset["name"] for preset in _presets()]
    if name not in known:
        raise MissingError(f"there is no preset {name!r}{suggest(name, known)}")
    return presets.load(name)


def typical_of(lab: Lab, name: str, label: str) -> bytes:
    """Return the typical run of a condition, as JSON.

    Raise StudyError as `find_study`, and for a damaged record.
    """
    study = find_study(lab, name)
    find_condition(study, label)
    stored = [study.path(label, run) for run in study.runs(label)]
    if not stored:
        raise MissingError(f"{study.directory} has no run of {label}")
    for path in stored:
        require_inside(lab.root, path)
    written = tuple(path.stat().st_mtime_ns for path in stored)

    def make() -> bytes:
        from baldwinlab.analysis.statistics.fitness import (
            typical_run,
        )  # here, because it takes a while to load

        return json.dumps({"run": typical_run(open_conditions(study, [label]), label)}).encode()

    return lab.cache.get(("typical", study.directory, label, written), make)


def results_of(lab: Lab, name: str) -> bytes:
    """Curves, final values and claims of a study, as JSON: null where a number does not exist.

    As they were kept beside its report, where they still fit. Where claims are not valid, `problem`
    says why. Raises StudyError as `find_study` does, and for a record that is damaged.
    """
    from baldwinlab.api.publish import lab_results

    study = find_study(lab, name)
    stored = [study.path(name, run) for name in study.experiments for run in study.runs(name)]
    claims = study.directory / CLAIMS
    for path in (
        *stored,
        claims,
        study.directory / lab_results.FILE,
        study.directory / sweeps.FILE,
    ):
        require_inside(lab.root, path)
    written = tuple((path, path.stat().st_mtime_ns) for path in (*stored, claims) if path.exists())

    def answer() -> bytes:
        found = lab_results.kept(study) or lab_results.of_study(study)
        return json.dumps(found | _claims_of(study)).encode()

    return lab.cache.get(("results", study.directory, written), answer)


def _claims_of(study: StudyStore) -> dict[str, Any]:
    """The claims of a study; none where they are not valid, and the problem."""
    try:
        return {"claims": claims_in(study), "problem": None}
    except StudyError as error:
        return {"claims": [], "problem": str(error)}
