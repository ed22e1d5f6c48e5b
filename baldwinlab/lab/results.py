"""Routes of the Results tab that are requested separately: runs, reaction norms, and figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.lab import Lab
from baldwinlab.lab.concurrency import QueuedResponse
from baldwinlab.lab.downloads import make_attachment
from baldwinlab.lab.query import Query, read_text
from baldwinlab.lab.study_access import find_condition, find_study, require_inside
from baldwinlab.studies.records import StudyError

MEDIA_TYPES: Final = {
    "svg": "image/svg+xml",
    "pdf": "application/pdf",
    "png": "image/png",
    "csv": "text/csv",
}


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    async def run_curves(request: Request) -> Response:
        query = request.query_params
        study = read_text(query, "study")
        condition = read_text(query, "condition")
        measure = read_text(query, "measure")
        return QueuedResponse(
            lab,
            lambda: Response(
                load_run_curves(lab, study, condition, measure), media_type="application/json"
            ),
        )

    async def reaction_norms(request: Request) -> Response:
        study = read_text(request.query_params, "study")
        return QueuedResponse(
            lab, lambda: Response(load_reaction_norms(lab, study), media_type="application/json")
        )

    async def figure(request: Request) -> Response:
        query = request.query_params
        conditions = query.getlist("condition")
        return QueuedResponse(lab, lambda: _make_figure_response(lab, query, conditions))

    return [
        Route("/api/results/figure", figure),
        Route("/api/results/runs", run_curves),
        Route("/api/results/reaction", reaction_norms),
    ]


def _make_figure_response(lab: Lab, query: Query, conditions: list[str]) -> Response:
    """Return a figure of the report as a file.

    Raise MissingError, and StudyError and ValueError as `make_figure_file`.
    """
    # This import takes a second, which would delay the first page.
    from baldwinlab.api.publish.result_figures import make_figure_file

    study = find_study(lab, read_text(query, "study"))
    for condition in conditions:
        find_condition(study, condition)
    name, file_format = read_text(query, "figure"), read_text(query, "format")
    file = make_figure_file(study, name, file_format, conditions)
    return make_attachment(file.content, MEDIA_TYPES[file_format], file.name)


def load_run_curves(lab: Lab, name: str, condition: str, measure: str) -> bytes:
    """Return the curve of each run of a condition, as JSON.

    Raise MissingError, and StudyError and ValueError as `lab_results.read_run_curves`.
    """
    # This import takes a second, which would delay the first page.
    from baldwinlab.api.publish import lab_results

    study = find_study(lab, name)
    find_condition(study, condition)
    record_paths = [file.path for file in study.files(condition)]
    versions = _read_file_versions(lab, record_paths)
    return lab.cache.get(
        ("runs", study.directory, condition, measure, versions),
        lambda: json.dumps(lab_results.read_run_curves(study, condition, measure)).encode(),
    )


def load_reaction_norms(lab: Lab, name: str) -> bytes:
    """Return the reaction norms of a study, as JSON. They are empty if the assay is not stored.

    Raise StudyError, and ValueError for a damaged assay.
    """
    # This import takes a second, which would delay the first page.
    from baldwinlab.api.publish import lab_results

    study = find_study(lab, name)
    folder = study.directory / "assays" / "reaction"
    versions = _read_file_versions(lab, [folder, *sorted(folder.rglob("*.nc"))])
    return lab.cache.get(
        ("reaction", study.directory, versions),
        lambda: json.dumps(lab_results.read_reaction_norms(study)).encode(),
    )


def _read_file_versions(lab: Lab, paths: list[Path]) -> tuple[tuple[Path, int], ...]:
    """Return the existing paths with their modification times, in nanoseconds.

    Raise StudyError for a path outside the served folder, and for a special file such as a pipe.
    """
    for path in paths:
        require_inside(lab.root, path)
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise StudyError(f"{path} is not a file")
    return tuple((path, path.stat().st_mtime_ns) for path in paths if path.exists())
