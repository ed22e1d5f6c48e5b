"""The web application (routes, access control, and responses to errors), and the web server."""

from __future__ import annotations

import logging
import socket
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from functools import partial
from http import HTTPStatus
from pathlib import Path
from typing import Final

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket
from uvicorn import Config, Server

from baldwinlab.analysis import palette, typeface
from baldwinlab.analysis.movie import MovieError
from baldwinlab.core.console import clip_for_terminal
from baldwinlab.lab import Lab, MissingError
from baldwinlab.lab.pages.single_page import STATIC_FOLDER
from baldwinlab.lab.server.access import Access
from baldwinlab.lab.server.connections import LimitedProtocol
from baldwinlab.lab.server.origin_check import OriginCheck
from baldwinlab.lab.server.responses import ChunkedResponses
from baldwinlab.lab.server.routes import make_routes
from baldwinlab.lab.sources import live
from baldwinlab.lab.sources.comparisons import Comparisons
from baldwinlab.studies.records import StudyError

MAX_CONNECTIONS: Final = 128
# Bytes of a message from a page through a websocket.
MAX_MESSAGE_BYTES: Final = 2**12
# Seconds to finish responses when the server stops.
SHUTDOWN_TIMEOUT: Final = 1


def make_app(
    root: Path,
    access: Access,
    is_engine_ready: Callable[[], bool] = lambda: True,
    command: Sequence[str] = ("baldwinlab", "lab"),
    root_path: str | None = None,
) -> Starlette:
    """Return the application that serves the studies in `root`, at any depth.

    `is_engine_ready` and `command`: see `Lab`. `root_path`: see `OriginCheck`.
    """
    lab = Lab(root.resolve(), live.Live(), is_engine_ready=is_engine_ready, command=command)
    comparisons = Comparisons()

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        yield
        lab.live.close()
        comparisons.close()

    static_files = Mount("/", StaticFiles(directory=STATIC_FOLDER, html=True))
    return Starlette(
        routes=[
            *make_routes(lab, comparisons),
            Route("/palette.css", _respond_palette),
            WebSocketRoute("/{path:path}", _reject_websocket),
            Mount("/fonts", StaticFiles(directory=typeface.FOLDER)),
            static_files,
        ],
        lifespan=lifespan,
        middleware=[
            Middleware(ChunkedResponses),
            Middleware(OriginCheck, access=access, root_path=root_path),
        ],
        exception_handlers={
            ClientDisconnect: _respond_disconnected,
            MissingError: partial(_respond_error, status=HTTPStatus.NOT_FOUND),
            **dict.fromkeys((StudyError, MovieError, ValueError), _respond_error),
            HTTPException: _respond_http_error,
            Exception: _respond_server_error,
        },
    )


class QuietServer(Server):
    """A server that stops without error messages, also with open connections."""

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Close all connections."""
        logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)
        await super().shutdown(sockets)


def make_server(app: ASGIApp) -> Server:
    """Return the server of an application. The caller runs it with a listening socket."""
    return QuietServer(
        Config(
            app,
            http=LimitedProtocol,
            lifespan="on",
            limit_concurrency=MAX_CONNECTIONS,
            log_level="warning",
            timeout_graceful_shutdown=SHUTDOWN_TIMEOUT,
            ws_max_size=MAX_MESSAGE_BYTES,
        )
    )


def _respond_palette(request: Request) -> Response:
    return Response(typeface.font_css("fonts") + palette.lab_css(), media_type="text/css")


def _respond_disconnected(request: Request, error: Exception) -> Response:
    """Return an empty response, because the client has closed the connection."""
    return Response(status_code=HTTPStatus.BAD_REQUEST)


def _respond_error(
    request: Request, error: Exception, status: HTTPStatus = HTTPStatus.BAD_REQUEST
) -> JSONResponse:
    return _make_error_response(str(error), status)


def _respond_http_error(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    if error.status_code == HTTPStatus.NOT_FOUND:
        message = f"there is no {request.url.path} here"
    else:
        message = f"{request.url.path}: {error.detail}"
    return _make_error_response(message, error.status_code)


def _respond_server_error(request: Request, error: Exception) -> JSONResponse:
    """Report an unexpected error, for example a full disk or a bug.

    The server continues, and prints the traceback to its own output.
    """
    message = f"the lab failed at {request.url.path}: {error or type(error).__name__}"
    return _make_error_response(message, HTTPStatus.INTERNAL_SERVER_ERROR)


def _make_error_response(message: str, status: int) -> JSONResponse:
    return JSONResponse({"error": clip_for_terminal(message)}, status)


async def _reject_websocket(websocket: WebSocket) -> None:
    """Close a websocket of an unknown path. Closing it before `accept` responds with status 403."""
    await websocket.close()
