"""Answers that are large or take a while: few of them are held at a time."""

from __future__ import annotations

from collections.abc import Callable

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from baldwinlab.lab import Lab
from baldwinlab.lab.memory import give_back


class InTurn(Response):
    """An answer that is made when it is its turn, which lasts until the client has taken it: so its bytes are bounded too."""

    def __init__(self, lab: Lab, make: Callable[[], Response]) -> None:
        self._turns, self._make = lab.turns, make

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async with self._turns:
            if await Request(scope, receive).is_disconnected():
                return  # nobody waits for it any longer
            made = await run_in_threadpool(self._make)
            await made(scope, receive, send)
            del made
            give_back()
