"""All requests of the page: paths, functions, parameters, and types of the responses.

The functions get the lab and the values of a request, and do not use HTTP. `app.py` turns a
MissingError into a response with status 404, and another StudyError or a ValueError into 400.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import partial
from http import HTTPStatus
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import quote

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket

from baldwinlab.core.files import REPORT_FILE, parse_json, read_text, require_size
from baldwinlab.core.third_party_code import raise_part_errors
from baldwinlab.experiment import registry
from baldwinlab.lab import Lab
from baldwinlab.lab.pages import downloads
from baldwinlab.lab.pages.downloads import Download
from baldwinlab.lab.server.responses import QueuedResponse, follow_live_run
from baldwinlab.lab.sources import (
    behavior,
    comparison_plan,
    experiment_form,
    frames,
    freezer,
    history,
    inspector,
    live,
    papers,
    presets,
    recording,
    results,
    studies,
    views,
)
from baldwinlab.lab.sources.comparisons import Comparisons
from baldwinlab.lab.sources.frames import WorldCursors

# An experiment, the largest part of a request, has some thousand bytes.
MAX_BODY_BYTES: Final = 2**20
JSON: Final = "application/json"
# The media type of a container, see `binary_frames`.
CONTAINER: Final = "application/octet-stream"
# A report in a study can be written by another program. The policy forbids scripts, forms and
# requests in the report. It keeps the origin of the lab, which answers no link of another origin.
REPORT_POLICY: Final = (
    "sandbox allow-same-origin allow-downloads; default-src 'none'; font-src data:; img-src data:;"
    " style-src 'unsafe-inline'"
)
# The parameters of a lifetime, see `life_query.find_life`.
LIFE: Final = ("study", "condition", "run", "generation", "live", "preset", "seed")
FRAME_WINDOW: Final = ("left", "top", "right", "bottom", "columns", "rows", "max_shapes")
LIFETIMES: Final = ("a", "b", "step")
COMPARISON: Final = ("presets", "preset", "experiment", "fields", "runs", "seed")
LIVE_RUN: Final = ("experiment", "runs", "seed", "seconds")


class Endpoint(NamedTuple):
    """A kind of request, and the function that computes the response.

    `load` gets the lab, and the parameters of a GET request or the fields of a POST request.
    """

    path: str
    load: Callable[[Lab, Any], Any]
    # The allowed parameters or fields. A request with any other name is rejected.
    names: tuple[str, ...] = ()
    method: str = "GET"
    status: HTTPStatus = HTTPStatus.OK
    # The media type if `load` returns bytes.
    media_type: str = JSON
    # A large response waits for a slot, because the number of these responses is limited.
    is_large: bool = False

    def make_route(self, lab: Lab) -> Route:
        """Return the route of this endpoint."""

        async def respond(request: Request) -> Response:
            values = await self._read_values(request)

            def make() -> Response:
                with raise_part_errors(find_labels=registry.label_files):
                    return _make_response(self.load(lab, values), self.media_type, self.status)

            return QueuedResponse(lab, make) if self.is_large else await run_in_threadpool(make)

        return Route(f"/api/{self.path}", respond, methods=[self.method])

    async def _read_values(self, request: Request) -> Mapping[str, Any]:
        """Return the parameters or fields of a request, and the values in the path."""
        has_body = self.method == "POST"
        values: Mapping[str, Any] = request.query_params
        _require_known_names(request, "parameter", values, () if has_body else self.names)
        if has_body:
            values = await _read_body(request, self.names) if self.names else {}
        return {**values, **request.path_params} if request.path_params else values


def list_endpoints(comparisons: Comparisons) -> list[Endpoint]:
    """Return all requests of the page, in the order of the page's tabs."""
    # `get`: small response. `load`: large JSON or a file. `load_container`: large binary response.
    # `post`: status 200. `create`: status 201.
    get = Endpoint
    load = partial(Endpoint, is_large=True)
    load_container = partial(Endpoint, is_large=True, media_type=CONTAINER)
    post = partial(Endpoint, method="POST")
    create = partial(Endpoint, method="POST", status=HTTPStatus.CREATED)
    load_frames = partial(frames.load_frames, WorldCursors())
    return [
        # Studies and results
        get("studies", studies.list_studies),
        load("results", results.load_results, ("study",)),
        load("typical", results.load_typical_run, ("study", "condition")),
        load("results/runs", results.load_run_curves, ("study", "condition", "measure")),
        load("results/reaction", results.load_reaction_norms, ("study",)),
        load(
            "results/figure",
            downloads.make_figure,
            ("study", "figure", "format", "condition", "measure"),
        ),
        # Lifetimes
        load_container("recording", recording.load_recording, (*LIFE, "first", "last")),
        load_container("agent", inspector.load_agent, (*LIFE, "agent", "first", "last")),
        load_container("frames", load_frames, (*LIFE, "first", "count", "interval", *FRAME_WINDOW)),
        load("run", history.load_fitness_curve, ("study", "condition", "run")),
        load("ancestors", history.load_ancestors, (*LIFE, "agent")),
        load("lineage", history.load_lineage, (*LIFE, "agent")),
        load("behavior", behavior.load_behavior, (*LIFE, "of")),
        load_container(
            "alleles",
            views.pack_frequencies,
            ("study", "condition", "run", "live", "generation"),
        ),
        load_container(
            "view",
            views.pack_view,
            ("study", "condition", "run", "generation", "view", "agent"),
        ),
        # Live runs and comparisons
        get("presets", experiment_form.describe_presets),
        get("preset", presets.read_preset, ("name",)),
        post("validate", experiment_form.check, LIVE_RUN),
        post("schema", experiment_form.load_form, ("experiment",)),
        post("appearance", experiment_form.preview_world, ("experiment",)),
        create("live", live.start_run, LIVE_RUN),
        get("live", live.describe_runs),
        create("live/{id}/save", live.save_run, ("name",)),
        post("live/{id}/stop", live.stop_run),
        Endpoint("live/{id}", live.remove_run, method="DELETE"),
        post("comparison/plan", comparison_plan.describe_plan, COMPARISON),
        create("comparison", comparisons.start_requested, (*COMPARISON, "name")),
        get("comparison", comparisons.describe_last),
        post("comparison/stop", comparisons.stop_last),
        # Genome files
        get("freezer", freezer.list_files),
        create("freezer", freezer.save_agents, ("life", "name", "agent")),
        post("compete", freezer.start_competition, ("a", "b", "condition", "lives", "seed")),
        # Papers and files
        get("papers", papers.list_cards, ("paper",)),
        get("papers/picture", papers.find_picture, ("paper",)),
        load("share", downloads.make_replay, LIFETIMES),
        load("laboratory", downloads.make_laboratory, LIFETIMES),
        load("movie", downloads.make_movie, (*LIFETIMES, "format", "ticket")),
        get("movie/progress", downloads.read_movie_progress, ("ticket",)),
        get("report/{path:path}", _respond_report),
    ]


def make_routes(lab: Lab, comparisons: Comparisons) -> list[BaseRoute]:
    """Return the routes of all endpoints, of live runs, and of the state of the engine."""

    # Pages use this request to detect a closed server. It is quick, so it needs no thread.
    async def engine(request: Request) -> JSONResponse:
        _require_known_names(request, "parameter", request.query_params, ())
        return JSONResponse({"ready": lab.is_engine_ready()})

    async def follow(websocket: WebSocket) -> None:
        await follow_live_run(websocket, lab.live)

    return [
        *(endpoint.make_route(lab) for endpoint in list_endpoints(comparisons)),
        Route("/api/engine", engine),
        WebSocketRoute("/api/live/{id}", follow),
    ]


def _make_response(content: Any, media_type: str, status: HTTPStatus) -> Response:
    """Return the response with a content: a response, a file, a download, bytes or JSON."""
    if isinstance(content, Response):
        return content
    if isinstance(content, Path):
        return _respond_file(content)
    if isinstance(content, Download):
        headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(content.name)}"}
        return Response(content.content, media_type=content.media_type, headers=headers)
    if isinstance(content, bytes):
        return Response(content, media_type=media_type)
    return JSONResponse(content, status)


def _respond_report(lab: Lab, query: Mapping[str, str]) -> Response:
    """Return the report of a study, or the file of a figure of the report."""
    name = query["path"]
    path = downloads.find_report(lab, name)
    headers = {"Content-Security-Policy": REPORT_POLICY}
    if path.suffix == ".html":
        page = downloads.link_lifetimes(
            read_text(path, REPORT_FILE), name.rpartition("/")[0] or "."
        )
        return Response(page, headers=headers, media_type="text/html")
    if path.suffix in (".pdf", ".csv"):
        # A browser shows no PDF file in a sandbox, and a table is for other programs.
        return _respond_file(path, headers=headers, filename=path.name)
    return _respond_file(path, headers=headers)


def _respond_file(path: Path, **options: Any) -> FileResponse:
    """Return a file as a response. Raise ValueError if it is too large or not regular."""
    try:
        require_size(path, REPORT_FILE)
    except (OSError, ValueError) as error:
        raise ValueError(f"{path} cannot be read: {error}") from None
    return FileResponse(path, **options)


async def _read_body(request: Request, names: Collection[str]) -> dict[str, Any]:
    """Return the JSON body of a request. Raise ValueError for a field without one of `names`."""
    raw = bytearray()
    async for chunk in request.stream():
        raw += chunk
        if len(raw) > MAX_BODY_BYTES:
            raise HTTPException(
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
                f"the body may have at most {MAX_BODY_BYTES:,} bytes",
            )
    try:
        body = parse_json(bytes(raw))
    except (json.JSONDecodeError, UnicodeDecodeError):
        body = None
    if not isinstance(body, dict):
        raise ValueError(f"{request.url.path} needs a JSON object")
    _require_known_names(request, "field", body, names)
    return body


def _require_known_names(
    request: Request, kind: str, names: Iterable[str], known_names: Collection[str]
) -> None:
    """Raise ValueError for a field or a parameter that a route does not read."""
    for name in names:
        if name not in known_names:
            known = ", ".join(known_names) or "none"
            raise ValueError(f"{request.url.path} has no {kind} {name!r}; it reads {known}")
