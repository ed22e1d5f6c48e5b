"""Routes of the Results tab that are requested separately: runs, reaction norms, and figures."""

from __future__ import annotations

import json
from functools import partial
from typing import Final

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.lab import Lab
from baldwinlab.lab.concurrency import QueuedResponse, queue_content
from baldwinlab.lab.downloads import make_attachment
from baldwinlab.lab.query import Query, read_text
from baldwinlab.lab.study_access import find_condition, find_study, read_versions

MEDIA_TYPES: Final = {
    "svg": "image/svg+xml",
    "pdf": "application/pdf",
    "png": "image/png",
    "csv": "text/csv",
}


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    async def figure(request: Request) -> Response:
        query = request.query_params
        conditions = query.getlist("condition")
        return QueuedResponse(lab, lambda: _make_figure_response(lab, query, conditions))

    return [
        Route("/api/results/figure", figure),
        Route("/api/results/runs", queue_content(lab, partial(load_run_curves, lab))),
        Route("/api/results/reaction", queue_content(lab, partial(load_reaction_norms, lab))),
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


def load_run_curves(lab: Lab, query: Query) -> bytes:
    """Return the curve of each run of a condition, as JSON.

    Raise MissingError, and StudyError and ValueError as `lab_results.read_run_curves`.
    """
    # This import takes a second, which would delay the first page.
    from baldwinlab.api.publish import lab_results

    study = find_study(lab, read_text(query, "study"))
    condition = find_condition(study, read_text(query, "condition")).name
    measure = read_text(query, "measure")
    versions = read_versions(lab.root, [file.path for file in study.files(condition)])
    return lab.cache.get(
        ("runs", study.directory, condition, measure, versions),
        lambda: json.dumps(lab_results.read_run_curves(study, condition, measure)).encode(),
    )


def load_reaction_norms(lab: Lab, query: Query) -> bytes:
    """Return the reaction norms of a study, as JSON. They are empty if the assay is not stored.

    Raise StudyError, and ValueError for a damaged assay.
    """
    # This import takes a second, which would delay the first page.
    from baldwinlab.api.publish import lab_results

    study = find_study(lab, read_text(query, "study"))
    folder = study.directory / "assays" / "reaction"
    versions = read_versions(lab.root, [folder, *sorted(folder.rglob("*.nc"))])
    return lab.cache.get(
        ("reaction", study.directory, versions),
        lambda: json.dumps(lab_results.read_reaction_norms(study)).encode(),
    )
