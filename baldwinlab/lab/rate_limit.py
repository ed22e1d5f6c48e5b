"""Limits of the connections, the time and the memory that clients of the server can use.

A client has a limited time to send a complete request, and to receive each chunk of the response.
The server writes only one chunk ahead of the client.
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

# Seconds to send a request, or to receive a chunk of the response.
CLIENT_TIMEOUT: Final = 5.0
MAX_CONNECTIONS: Final = 128
# Bytes of a response that the server writes before the client reads them.
CHUNK_BYTES: Final = 2**17
# Bytes of a message from a page through a websocket.
MAX_MESSAGE_BYTES: Final = 2**12
# Seconds to finish responses when the server stops.
SHUTDOWN_TIMEOUT: Final = 1
TOO_MANY_CONNECTIONS_ERROR: Final = (
    b'{"error": "the lab has reached its limit of %d open connections; close some of its pages"}'
    % MAX_CONNECTIONS
)


class Connection(H11Protocol):
    """A connection that the server closes if the client is too slow."""

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Refuse the connection if there are too many, and start the timeout."""
        super().connection_made(transport)
        if len(self.connections) > MAX_CONNECTIONS:
            head = (
                "HTTP/1.1 503 Service Unavailable\r\n"
                "Content-Type: application/json\r\n"
                "Connection: close\r\n"
                f"Content-Length: {len(TOO_MANY_CONNECTIONS_ERROR)}\r\n\r\n"
            )
            transport.write(head.encode() + TOO_MANY_CONNECTIONS_ERROR)
            transport.close()
        self._start_timeout()

    def data_received(self, data: bytes) -> None:
        """Start the timeout for the rest of an incomplete request, or stop it."""
        super().data_received(data)
        # The protocol of a websocket replaces this object after the handshake.
        is_websocket = self.transport.get_protocol() is not self
        is_incomplete = self.conn.their_state in (h11.IDLE, h11.SEND_BODY)
        if is_incomplete and not is_websocket:
            self._start_timeout()
        elif not self.flow.write_paused:
            self._stop_timeout()

    def pause_writing(self) -> None:
        """Start the timeout, because the client has not read the last chunk."""
        super().pause_writing()
        self._start_timeout()

    def resume_writing(self) -> None:
        """Stop the timeout, because the client has read the last chunk."""
        super().resume_writing()
        self._stop_timeout()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the timeout of a closed connection."""
        super().connection_lost(exc)
        self._stop_timeout()

    def _start_timeout(self) -> None:
        if self._deadline is None:
            self._deadline = self.loop.call_later(CLIENT_TIMEOUT, self.transport.abort)

    def _stop_timeout(self) -> None:
        if self._deadline:
            self._deadline.cancel()
        self._deadline = None


class RateLimitedServer(Server):
    """A server that stops soon, even with open connections, without error messages."""

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Close all connections without error messages."""
        logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)
        await super().shutdown(sockets)


def make_server(app: ASGIApp) -> Server:
    """Return the server of an application. It runs on a listening socket."""
    return RateLimitedServer(
        Config(
            app,
            http=Connection,
            lifespan="on",
            log_level="warning",
            timeout_graceful_shutdown=SHUTDOWN_TIMEOUT,
            ws_max_size=MAX_MESSAGE_BYTES,
        )
    )


class ChunkedResponses:
    """Middleware that sends large responses in chunks, to bound the memory of each client."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run the application with a `send` that splits bodies into chunks."""

        async def send_in_chunks(message: Message) -> None:
            if "body" not in message:
                await send(message)
                return
            # A slice of a memoryview is not a copy.
            rest = memoryview(message["body"])
            while len(rest) > CHUNK_BYTES:
                chunk = bytes(rest[:CHUNK_BYTES])
                await send({"type": message["type"], "body": chunk, "more_body": True})
                rest = rest[CHUNK_BYTES:]
            await send({**message, "body": bytes(rest)})

        await self.app(scope, receive, send_in_chunks)
