"""Responses to clients that can be slow: large responses, and the websocket of a live run.

The number of large responses in memory is limited, and a client that does not read is disconnected.
A live run does not send its generations to pages. Instead, each connection looks for new
generations several times per second. Slow pages therefore do not delay other pages, and a page that
connects again receives all generations.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

import anyio
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from baldwinlab.core.files import parse_json
from baldwinlab.lab import Lab, MissingError, release_memory
from baldwinlab.lab.sources.live import Live, summarize_run
from baldwinlab.lab.sources.live_run import LiveRun

# Seconds to receive a chunk of a response, or a message of a websocket.
CLIENT_TIMEOUT: Final = 5.0
# Size of the pieces of a large response. The server waits until the client has read a piece.
CHUNK_BYTES: Final = 2**17


class QueuedResponse(Response):
    """A response that is built when one of the slots of the lab is free.

    The slot is in use until the client has received the response. This limits the memory.
    """

    def __init__(self, lab: Lab, make: Callable[[], Response]) -> None:
        self._slots = lab.response_slots
        self._make = make

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Wait for a slot, build the response and send it, unless the client has disconnected."""
        async with self._slots:
            if await Request(scope, receive).is_disconnected():
                return
            response = await run_in_threadpool(self._make)
            await response(scope, receive, send)
            # The memory can be released only after the last reference is deleted.
            del response
            release_memory()


class UnreadResponseError(Exception):
    """A client has not received a chunk of a response in time."""


class ChunkedResponses:
    """Middleware that sends responses in chunks, and drops a response that a client does not read.

    Such a response would otherwise use memory and a slot without end.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run the application with a `send` that splits bodies into chunks."""

        async def send_in_chunks(message: Message) -> None:
            if "body" not in message:
                await _send_in_time(send, message)
                return
            # A slice of a memoryview is not a copy.
            rest = memoryview(message["body"])
            while len(rest) > CHUNK_BYTES:
                chunk = bytes(rest[:CHUNK_BYTES])
                part = {"type": message["type"], "body": chunk, "more_body": True}
                await _send_in_time(send, part)
                rest = rest[CHUNK_BYTES:]
            await _send_in_time(send, {**message, "body": bytes(rest)})

        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        try:
            await self.app(scope, receive, send_in_chunks)
        except UnreadResponseError:
            # After an incomplete response, the server closes the connection by itself.
            return


async def _send_in_time(send: Send, message: Message) -> None:
    """Send a message. Raise UnreadResponseError if the client has not read earlier messages."""
    try:
        with anyio.fail_after(CLIENT_TIMEOUT):
            await send(message)
    except TimeoutError:
        raise UnreadResponseError from None


# Seconds between two checks for new generations.
POLL_SECONDS: Final = 0.05
MAX_GENERATIONS_PER_MESSAGE: Final = 500


async def _send(websocket: WebSocket, message: dict[str, Any]) -> None:
    """Send a message. Raise TimeoutError if the page does not read the message in time."""
    with anyio.fail_after(CLIENT_TIMEOUT):
        await websocket.send_json(message)


async def _send_progress(websocket: WebSocket, run: LiveRun) -> None:
    """Send all generations of a run, and new ones until the run has ended."""
    n_sent = 0
    sent_state = ""
    await _send(websocket, {"type": "run", **summarize_run(run)})
    while True:
        # The state is read first. If a run ends between these lines, the next pass sends the
        # generations that are missing here, and then the end.
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
    """Handle the commands of a page, as text or as bytes."""
    while (message := await websocket.receive())["type"] == "websocket.receive":
        try:
            run.handle_command(parse_json(message.get("text") or message.get("bytes") or ""))
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


async def follow_live_run(websocket: WebSocket, live: Live) -> None:
    """Serve a page that follows a live run."""
    await websocket.accept()
    try:
        with live.watch(websocket.path_params["id"]) as run:
            await _serve_page(websocket, run)
    except MissingError as error:
        # The page may have left during the handshake.
        with suppress(WebSocketDisconnect):
            await websocket.send_json({"type": "state", "state": "removed", "message": str(error)})
            await websocket.close()
