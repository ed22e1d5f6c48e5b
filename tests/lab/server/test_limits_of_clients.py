"""Tests of the limits for clients: unread responses, connections and size of requests."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from urllib.parse import urlencode

import anyio
import pytest
from starlette.responses import Response
from starlette.types import Message

from baldwinlab.lab import MAX_QUEUED_RESPONSES, Lab
from baldwinlab.lab.server import app, connections, responses
from baldwinlab.lab.server.routes import MAX_BODY_BYTES
from baldwinlab.lab.sources import live
from tests.lab.client import CLIENT, SMALL, LabServer, get_response
from tests.lab.conftest import run_server
from tests.small_studies import shorten_preset

# The timeout of clients in these tests, in seconds.
TIMEOUT = 0.3


@pytest.fixture
def strict_server(lab_server: LabServer, monkeypatch: pytest.MonkeyPatch) -> Iterator[LabServer]:
    """Yield a server with a short timeout."""
    monkeypatch.setattr(responses, "CLIENT_TIMEOUT", TIMEOUT)
    with run_server(lab_server.root) as server:
        yield server


@pytest.fixture
def narrow_server(lab_server: LabServer, monkeypatch: pytest.MonkeyPatch) -> Iterator[LabServer]:
    """Yield a server with at most 20 clients."""
    monkeypatch.setattr(app, "MAX_CONNECTIONS", 20)
    monkeypatch.setattr(connections, "MAX_WAITING", 20)
    with run_server(lab_server.root) as narrow:
        yield narrow


@contextmanager
def open_client(server: LabServer, lines: str) -> Iterator[socket.socket]:
    """Yield a client that has sent these lines and has a small receive buffer.

    PORT and COOKIE are replaced by those of the server.
    """
    with closing(socket.socket()) as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2**16)
        connection.settimeout(300)
        connection.connect(("127.0.0.1", server.port))
        connection.sendall(server.request(lines))
        yield connection


def receive_all(connection: socket.socket, pause: float = 0) -> bytes:
    """Return the bytes until the server closes the connection."""
    content = bytearray()
    try:
        while more := connection.recv(2**16):
            content += more
            time.sleep(pause)
    except ConnectionResetError:
        pass
    return bytes(content)


RECORDING = (
    f"GET /api/recording?{urlencode(SMALL)} HTTP/1.1\nHost: 127.0.0.1:PORT\nCookie: COOKIE\n"
)
# The responses of 90 kB exceed the buffers of the operating system.
REQUESTS = f"{RECORDING}\n" * 99 + f"{RECORDING}Connection: close\n\n"


# The buffers of the operating system are full only after a while.
@pytest.mark.nightly
def test_a_client_that_does_not_read_a_response_is_disconnected(strict_server: LabServer) -> None:
    # The recording is in the cache for the next requests.
    assert get_response(strict_server.address, "recording", **SMALL).status_code == 200

    def count_responses(pause: float) -> int:
        with open_client(strict_server, REQUESTS) as connection:
            time.sleep(pause)
            return receive_all(connection).count(b"HTTP/1.1 200 OK")

    # A machine under load needs more time to fill the buffers.
    assert any(count_responses(pause) < 100 for pause in (1.5, 6, 24))


def test_responses_that_are_not_read_release_their_slots(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(responses, "CLIENT_TIMEOUT", TIMEOUT)
    lab = Lab(tmp_path, live.Live())
    body = b"0" * 2 * responses.CHUNK_BYTES
    queued = responses.QueuedResponse(lab, lambda: Response(body))
    chunked = responses.ChunkedResponses(queued)
    received = list[Message]()

    async def receive_nothing() -> Message:
        await anyio.sleep_forever()
        raise AssertionError

    async def send_nothing(message: Message) -> None:
        await anyio.sleep_forever()

    async def send(message: Message) -> None:
        received.append(message)

    async def request_all() -> None:
        with anyio.fail_after(60):
            async with anyio.create_task_group() as group:
                for _ in range(2 * MAX_QUEUED_RESPONSES):
                    group.start_soon(chunked, {"type": "http"}, receive_nothing, send_nothing)
            await chunked({"type": "http"}, receive_nothing, send)

    # The browser of another test can hold an event loop in this thread.
    with ThreadPoolExecutor(1) as pool:
        pool.submit(anyio.run, request_all).result()
    assert b"".join(message.get("body", b"") for message in received) == body


def test_a_client_that_reads_slowly_receives_the_complete_response(lab_server: LabServer) -> None:
    with open_client(lab_server, REQUESTS) as connection:
        assert receive_all(connection, pause=0.001).count(b"HTTP/1.1 200 OK") == 100


def test_a_page_that_only_receives_is_not_disconnected(strict_server: LabServer) -> None:
    request = {
        "experiment": shorten_preset().replace(evolution={"generations": 1000}).to_dict(),
        "seconds": TIMEOUT,
    }
    id = CLIENT.post(f"{strict_server.address}/api/live", json=request).json()["id"]
    with strict_server.websocket(f"/api/live/{id}") as page:
        deadline = time.monotonic() + 5 * TIMEOUT
        while time.monotonic() < deadline:
            page.recv(timeout=300)
        page.send('{"command": "stop"}')


def test_connections_above_the_limit_are_rejected(narrow_server: LabServer) -> None:
    address = f"{narrow_server.address}/api/studies"
    with ExitStack() as stack:
        for _ in range(20):
            stack.enter_context(open_client(narrow_server, ""))
        while CLIENT.get(address).status_code != 503:
            # The server has not accepted all clients yet.
            time.sleep(0.01)
    while CLIENT.get(address).status_code != 200:
        time.sleep(0.01)


HALF_A_HEADER = "GET /api/studies HTTP/1.1\nHost: 127"
HALF_A_BODY = (
    "POST /api/validate HTTP/1.1\nHost: 127.0.0.1:PORT\nCookie: COOKIE\nContent-Length: 9\n\n{"
)


@pytest.mark.parametrize("lines", [HALF_A_HEADER, HALF_A_BODY, ""])
def test_many_clients_that_send_nothing_more_do_not_block_others(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch, lines: str
) -> None:
    monkeypatch.setattr(connections, "REQUEST_TIMEOUT", 3600)
    with run_server(lab_server.root) as server, ExitStack() as stack:
        clients = [stack.enter_context(open_client(server, lines)) for _ in range(200)]
        assert get_response(server.address, "studies").status_code == 200
        answer = receive_all(clients[0])
    assert (b"503 Service Unavailable" in answer) == bool(lines)
    assert (b"too many clients send requests slowly" in answer) == bool(lines)


@pytest.mark.parametrize("lines", [HALF_A_HEADER, HALF_A_BODY])
def test_a_client_that_does_not_complete_its_request_is_disconnected(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch, lines: str
) -> None:
    monkeypatch.setattr(connections, "REQUEST_TIMEOUT", TIMEOUT)
    with run_server(lab_server.root) as server, open_client(server, lines) as connection:
        answer = receive_all(connection)
    assert answer.startswith(b"HTTP/1.1 408 Request Timeout")
    assert b"the lab waits 0.3 s for a header, and for 4,096 bytes of a body" in answer


def test_one_byte_at_a_time_does_not_extend_the_time_of_a_request(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "REQUEST_TIMEOUT", TIMEOUT)
    endless_body = HALF_A_BODY.replace("Length: 9", "Length: 1000000")
    denied_body = endless_body.replace("COOKIE", "none")
    with run_server(lab_server.root) as server:
        for lines in (HALF_A_HEADER, endless_body, denied_body):
            with open_client(server, lines) as connection, pytest.raises(OSError):
                while True:
                    connection.sendall(b"1")
                    time.sleep(TIMEOUT / 10)


def test_a_body_above_the_minimal_rate_is_received(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "REQUEST_TIMEOUT", TIMEOUT)
    monkeypatch.setattr(connections, "MIN_BODY_BYTES", 1)
    spaces = 10
    lines = HALF_A_BODY.replace("Length: 9", f"Length: {spaces + 2}")
    lines = lines.replace("Content", "Connection: close\nContent")
    with run_server(lab_server.root) as server, open_client(server, lines) as connection:
        for _ in range(spaces):
            time.sleep(TIMEOUT / 5)
            connection.sendall(b" ")
        connection.sendall(b"}")
        assert b" 408 " not in receive_all(connection)


@pytest.mark.parametrize("path", ["validate", "schema", "appearance", "live", "live/1/save"])
def test_the_size_and_the_depth_of_a_posted_body_are_limited(
    lab_server: LabServer, path: str
) -> None:
    address = f"{lab_server.address}/api/{path}"
    large = CLIENT.post(address, content=b" " * (MAX_BODY_BYTES + 1))
    assert large.status_code == 413
    assert large.json()["error"] == f"/api/{path}: the body may have at most 1,048,576 bytes"
    for depth in (33, 2000, 100_000):
        deep = CLIENT.post(address, content='{"a":' * depth + "1" + "}" * depth)
        assert (deep.status_code, deep.json()["error"]) == (
            400,
            "JSON may have 32 nested levels; this text has more",
        )
