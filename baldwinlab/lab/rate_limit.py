"""How much of the server one client may take, and for how long: whoever neither asks nor listens is cut off.

A client is given time for a whole request, and again for every piece of its answer; nothing is written ahead of it but a piece.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from typing import Final

import h11
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn import Config, Server
from uvicorn.protocols.http.h11_impl import H11Protocol

PATIENCE: Final = 5.0  # seconds for a request, and for a piece of its answer to be taken
MOST_CLIENTS: Final = 128  # connections at a time
PIECE: Final = 2**17  # bytes of an answer that are written before the client has taken those before
LONGEST_MESSAGE: Final = 2**12  # bytes that a page may send through a websocket
LAST_WORDS: Final = 1  # seconds that answers under way have to end when the server does
BUSY: Final = (
    b'{"error": "the lab has %d connections open, which is the most; close some of its pages"}'
    % MOST_CLIENTS
)


class Connection(H11Protocol):
    """A client's, which is ended when it keeps the server waiting."""

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if len(self.connections) > MOST_CLIENTS:
            head = "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\nConnection: close\r\n"
            transport.write(f"{head}Content-Length: {len(BUSY)}\r\n\r\n".encode() + BUSY)
            transport.close()
        self._wait()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        is_websocket = self.transport.get_protocol() is not self  # from now on
        if self.conn.their_state in (h11.IDLE, h11.SEND_BODY) and not is_websocket:
            self._wait()  # for the rest of the request
        elif not self.flow.write_paused:
            self._go_on()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._wait()

    def resume_writing(self) -> None:
        super().resume_writing()
        self._go_on()

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self._go_on()

    def _wait(self) -> None:
        self._deadline = self._deadline or self.loop.call_later(PATIENCE, self.transport.abort)

    def _go_on(self) -> None:
        if self._deadline:
            self._deadline.cancel()
        self._deadline = None


class Courteous(Server):
    """A server that ends soon, whoever is attached to it, and does not complain of what it then cuts off."""

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)
        await super().shutdown(sockets)


def server_of(app: ASGIApp) -> Server:
    """The server of an application, to be run on a socket that listens."""
    return Courteous(
        Config(
            app,
            http=Connection,
            lifespan="on",
            log_level="warning",
            timeout_graceful_shutdown=LAST_WORDS,
            ws_max_size=LONGEST_MESSAGE,
        )
    )


class InPieces:
    """Middleware that hands large answers over piece by piece, so that no client has more of one waiting for it."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_in_pieces(message: Message) -> None:
            body = memoryview(message.get("body", b""))
            while len(body) > PIECE:
                await send(
                    {"type": message["type"], "body": bytes(body[:PIECE]), "more_body": True}
                )
                body = body[PIECE:]
            await send({**message, "body": bytes(body)} if "body" in message else message)

        await self.app(scope, receive, send_in_pieces)
