"""The server: which routes there are, who may ask, and how a fault becomes a sentence on the page."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from baldwinlab.analysis.figures import palette
from baldwinlab.analysis.figures.movie import MovieError
from baldwinlab.core.console import clip_for_terminal
from baldwinlab.lab import (
    Lab,
    MissingError,
    agent_inspector,
    alleles,
    downloads,
    experiment_form,
    history,
    live,
    live_sweep,
    papers,
    recording,
    results,
    studies,
    views,
)
from baldwinlab.lab.access import Access
from baldwinlab.lab.origin_check import Guard
from baldwinlab.lab.rate_limit import InPieces
from baldwinlab.studies.records import StudyError

STATIC = Path(__file__).parent / "static"


def make_app(root: Path, access: Access, ready: Callable[[], bool] = lambda: True) -> Starlette:
    """Return the application that serves the studies in `root`, at any depth, to the holder of the token.

    Pages wait with simulations until the engine is `ready`.
    """
    lab, sweeps = Lab(root.resolve(), live.Live(), ready=ready), live_sweep.Sweeps()

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        yield
        lab.live.close()
        sweeps.close()

    def engine(request: Request) -> JSONResponse:
        return JSONResponse({"ready": lab.ready(), "seconds": time.monotonic() - lab.began})

    parts = (
        studies,
        papers,
        results,
        experiment_form,
        recording,
        agent_inspector,
        history,
        alleles,
        views,
        live,
        downloads,
    )
    routes = [route for part in parts for route in part.routes(lab)]
    routes += [
        *live_sweep.routes(lab, sweeps),
        Route("/api/engine", engine),
        Route("/palette.css", _palette),
    ]
    files = Mount("/", StaticFiles(directory=STATIC, html=True))
    return Starlette(
        routes=[*routes, WebSocketRoute("/{path:path}", _no_websocket), files],
        lifespan=lifespan,
        middleware=[Middleware(InPieces), Middleware(Guard, access=access)],
        exception_handlers={
            ClientDisconnect: _gone,
            MissingError: _not_there,
            StudyError: _refused,
            MovieError: _refused,
            ValueError: _refused,
            HTTPException: _http,
            Exception: _failed,
        },
    )


def _palette(request: Request) -> Response:
    return Response(palette.lab_css(), media_type="text/css")


def _gone(request: Request, error: Exception) -> Response:
    """Nobody is there any longer to read it."""
    return Response(status_code=400)


def _not_there(request: Request, error: Exception) -> JSONResponse:
    return _sentence(str(error), 404)


def _refused(request: Request, error: Exception) -> JSONResponse:
    return _sentence(str(error), 400)


def _http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    sentence = (
        f"there is no {request.url.path} here"
        if error.status_code == 404
        else f"{request.url.path}: {error.detail}"
    )
    return _sentence(sentence, error.status_code)


def _failed(request: Request, error: Exception) -> JSONResponse:
    """What nobody foresaw, a full disk or a fault of ours. The server goes on, and writes the whole of it to its own output."""
    return _sentence(f"the lab failed at {request.url.path}: {error or type(error).__name__}", 500)


def _sentence(words: str, status: int) -> JSONResponse:
    """A refusal that the page shows."""
    return JSONResponse({"error": clip_for_terminal(words)}, status)


async def _no_websocket(websocket: WebSocket) -> None:
    await websocket.close()  # never accepted, so the handshake is answered with 403
