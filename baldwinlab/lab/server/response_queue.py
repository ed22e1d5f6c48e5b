"""Limits of the memory that large responses use: the number of responses, and unread chunks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import anyio
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from baldwinlab.lab import Lab
from baldwinlab.lab.sources.memory import release_memory

# Seconds to receive a chunk of a response, or a message of a websocket.
CLIENT_TIMEOUT: Final = 5.0
# Bytes of a response that the server writes before the client reads them.
CHUNK_BYTES: Final = 2**17


class QueuedResponse(Response):
    """A response that is built only when a slot is free.

    The slot is held until the client has received the response, which bounds memory.
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
    """Middleware that sends large responses in chunks, and drops those that nobody reads.

    A response that is not read would hold its memory and its slot.
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
            # The server closes the connection of an incomplete response.
            return


async def _send_in_time(send: Send, message: Message) -> None:
    """Send a message. Raise UnreadResponseError if the client has not read the previous ones."""
    try:
        with anyio.fail_after(CLIENT_TIMEOUT):
            await send(message)
    except TimeoutError:
        raise UnreadResponseError from None
