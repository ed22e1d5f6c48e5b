"""What came of a study, as Results ask for it piece by piece: each run's curve, reaction norms."""

from __future__ import annotations

import json
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.lab import Lab
from baldwinlab.lab.concurrency import InTurn
from baldwinlab.lab.query import text
from baldwinlab.lab.studies import condition, find, require_inside
from baldwinlab.studies.records import StudyError


def routes(lab: Lab) -> list[BaseRoute]:
    async def runs(request: Request) -> Response:
        study, label, measure = (
            text(request.query_params, key) for key in ("study", "condition", "measure")
        )
        return InTurn(
            lab,
            lambda: Response(runs_of(lab, study, label, measure), media_type="application/json"),
        )

    async def norms(request: Request) -> Response:
        study = text(request.query_params, "study")
        return InTurn(lab, lambda: Response(norms_of(lab, study), media_type="application/json"))

    return [Route("/api/results/runs", runs), Route("/api/results/reaction", norms)]


def runs_of(lab: Lab, name: str, label: str, measure: str) -> bytes:
    """The curve of every run of a condition, as JSON. Raises MissingError, and StudyError and ValueError as `of_runs` does."""
    from baldwinlab.api.publish import (
        lab_results,  # here, because it takes a second to load, and the first page comes before
    )

    study = find(lab, name)
    condition(study, label)
    written = _written(lab, [study.path(label, run) for run in study.runs(label)])
    return lab.answers.get(
        ("runs", study.directory, label, measure, written),
        lambda: json.dumps(lab_results.of_runs(study, label, measure)).encode(),
    )


def norms_of(lab: Lab, name: str) -> bytes:
    """Reaction norms, as JSON; none where the assay is not stored. Raises StudyError, and ValueError for one that is damaged."""
    from baldwinlab.api.publish import lab_results  # as above

    study = find(lab, name)
    folder = study.directory / "assays" / "reaction"
    written = _written(lab, [folder, *sorted(folder.rglob("*.nc"))])
    return lab.answers.get(
        ("reaction", study.directory, written),
        lambda: json.dumps(lab_results.reaction_norms(study)).encode(),
    )


def _written(lab: Lab, paths: list[Path]) -> tuple[tuple[Path, int], ...]:
    """What there is, and when it was written. Raises StudyError for what lies outside, and for a pipe in the place of a file."""
    for path in paths:
        require_inside(lab.root, path)
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise StudyError(f"{path} is no file")
    return tuple((path, path.stat().st_mtime_ns) for path in paths if path.exists())
