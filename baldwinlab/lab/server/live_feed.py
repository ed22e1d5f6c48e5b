"""The websocket of a live run: sends its generations to a page, and receives commands.

The server does not push each generation. Each connection checks a few times per second for new
generations. Slow pages therefore do not delay others, and a page that reconnects receives all
generations.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any, Final

import anyio
from starlette.concurrency import run_in_threadpool
from starlette.websockets import WebSocket, WebSocketDisconnect

from baldwinlab.core.files import parse_json
from baldwinlab.lab import MissingError
from baldwinlab.lab.server.response_queue import CLIENT_TIMEOUT
from baldwinlab.lab.sources.live import Live, summarize_run
from baldwinlab.lab.sources.live_run import LiveRun

# Time between two checks for new generations.
POLL_SECONDS: Final = 0.05
MAX_GENERATIONS_PER_MESSAGE: Final = 500


async def _send(websocket: WebSocket, message: dict[str, Any]) -> None:
    """Send a message. Raise TimeoutError if the page does not read it."""
    with anyio.fail_after(CLIENT_TIMEOUT):
        await websocket.send_json(message)


async def _send_progress(websocket: WebSocket, run: LiveRun) -> None:
    """Send all generations of a run, and new ones until the run has ended."""
    n_sent = 0
    sent_state = ""
    await _send(websocket, {"type": "run", **summarize_run(run)})
    while True:
        # Read the state before the generations, so that the end is sent after the last generation.
        state = run.state
        has_ended = run.has_ended
        n_done = run.generations_done
        for first_generation in range(n_sent, n_done, MAX_GENERATIONS_PER_MESSAGE):
            stop = min(first_generation + MAX_GENERATIONS_PER_MESSAGE, n_done)
            measures = await run_in_threadpool(run.compute_measures, first_generation, stop)
            await _send(websocket, {"type": "generations", "first": first_generation, **measures})
        n_sent = n_done
        if state != sent_state:
            await _send(websocket, {"type": "state", "state": state, "message": run.message})
            sent_state = state
        if has_ended:
            return
        await anyio.sleep(POLL_SECONDS)


async def _receive_commands(websocket: WebSocket, run: LiveRun) -> None:
    """Handle the commands of a page."""
    async for text in websocket.iter_text():
        try:
            run.handle_command(parse_json(text))
        except ValueError as error:
            await _send(websocket, {"type": "problem", "message": str(error)})


async def _serve_page(websocket: WebSocket, run: LiveRun) -> None:
    """Send progress and receive commands until the page closes or stops reading."""
    async with anyio.create_task_group() as group:

        async def send_progress() -> None:
            try:
                await _send_progress(websocket, run)
            except (WebSocketDisconnect, TimeoutError):
                group.cancel_scope.cancel()

        group.start_soon(send_progress)
        with suppress(WebSocketDisconnect, TimeoutError):
            await _receive_commands(websocket, run)
        group.cancel_scope.cancel()


async def follow(websocket: WebSocket, live: Live) -> None:
    """Serve a page that follows a live run."""
    await websocket.accept()
    try:
        with live.watch(websocket.path_params["id"]) as run:
            await _serve_page(websocket, run)
    except MissingError as error:
        await websocket.send_json({"type": "state", "state": "removed", "message": str(error)})
        await websocket.close()
