"""A response that waits for a free slot, which limits the large responses in memory."""

from __future__ import annotations

from collections.abc import Callable

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from baldwinlab.lab import Lab
from baldwinlab.lab.memory import release_memory


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
