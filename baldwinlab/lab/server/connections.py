"""Limits for connections whose client has not sent a complete request.

Such a connection waits: it has a time limit, and the number of waiting connections is limited.
Slow clients therefore do not use the connections of other clients. For example, of 200 clients that
each send half a header, `MAX_WAITING` are connected, each for at most `REQUEST_TIMEOUT` seconds.
"""

from __future__ import annotations

import asyncio
from http import HTTPStatus
from typing import Any, Final

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

# Seconds to send a header, or `MIN_BODY_BYTES` of a body.
REQUEST_TIMEOUT: Final = 5.0
MIN_BODY_BYTES: Final = 2**12
# When more connections wait, the server closes the one that waits longest.
MAX_WAITING: Final = 64


class LimitedProtocol(H11Protocol):
    """A connection that is closed if it waits too long, or if too many connections wait."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        # Shared by all connections of a server, the longest waiting connection first.
        self._waiting: dict[LimitedProtocol, asyncio.TimerHandle] = self.app_state.setdefault(
            "waiting_connections", {}
        )
        # The state of the client since the connection waits: h11.IDLE before a complete header.
        self._state: object = None
        self._received_bytes = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for a header."""
        super().connection_made(transport)
        self._update_waiting()

    def connection_lost(self, exc: Exception | None) -> None:
        """Do not wait."""
        super().connection_lost(exc)
        self._update_waiting()

    def data_received(self, data: bytes) -> None:
        """Count the received bytes, and handle them."""
        self._received_bytes += len(data)
        super().data_received(data)

    def handle_events(self) -> None:
        """Handle the received data, or the end of a response."""
        super().handle_events()
        self._update_waiting()

    def _update_waiting(self) -> None:
        """Start, continue or end to wait for the client."""
        # A connection that has become a websocket has left `connections`.
        state = self.conn.their_state if self in self.connections else None
        if state is self._state:
            return
        self._state = state
        if timer := self._waiting.pop(self, None):
            timer.cancel()
        if state in (h11.IDLE, h11.SEND_BODY):
            self._start_timer()
            if len(self._waiting) > MAX_WAITING:
                oldest = next(iter(self._waiting))
                oldest._refuse(
                    HTTPStatus.SERVICE_UNAVAILABLE, "too many clients send requests slowly"
                )

    def _start_timer(self) -> None:
        self._received_bytes = 0
        self._waiting[self] = self.loop.call_later(REQUEST_TIMEOUT, self._check_progress)

    def _check_progress(self) -> None:
        """Close the connection, unless its client sends a body fast enough."""
        if self._state is h11.SEND_BODY and (
            # The application has not yet read the received data.
            self.flow.read_paused or self._received_bytes >= MIN_BODY_BYTES
        ):
            self._start_timer()
        else:
            self._refuse(
                HTTPStatus.REQUEST_TIMEOUT,
                f"the lab waits {REQUEST_TIMEOUT:g} s for a header, and for {MIN_BODY_BYTES:,}"
                " bytes of a body",
            )

    def _refuse(self, status: HTTPStatus, message: str) -> None:
        """Close the connection, with a response to a request that has begun."""
        self._waiting.pop(self).cancel()
        has_begun = self._state is h11.SEND_BODY or self.conn.trailing_data[0]
        if has_begun and self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            content = f'{{"error": "{message}"}}'.encode()
            headers = [("content-type", "application/json"), ("connection", "close")]
            for event in (
                h11.Response(status_code=status, headers=headers, reason=status.phrase),
                h11.Data(data=content),
                h11.EndOfMessage(),
            ):
                self.transport.write(self.conn.send(event) or b"")
        self.transport.close()
