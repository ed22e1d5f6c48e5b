"""No client takes more of the server than its share, and none keeps it waiting."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from urllib.parse import urlencode

import httpx
import pytest

from baldwinlab.lab import rate_limit
from baldwinlab.lab.query import MAX_BODY_SIZE
from tests.lab.client import CLIENT, SMALL, LabServer, get_response
from tests.lab.conftest import run_server
from tests.small_studies import shorten_preset

SOON = 0.3  # seconds


@pytest.fixture
def impatient(lab_server: LabServer, monkeypatch: pytest.MonkeyPatch) -> Iterator[LabServer]:
    monkeypatch.setattr(rate_limit, "CLIENT_TIMEOUT", SOON)
    monkeypatch.setattr(rate_limit, "MAX_CLIENTS", 20)
    with run_server(lab_server.root) as server:
        yield server


@contextmanager
def client(server: LabServer, lines: str) -> Iterator[socket.socket]:
    """One that has sent this much, and takes little at a time. PORT and COOKIE stand for the server's."""
    with closing(socket.socket()) as it:
        it.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2**16)
        it.settimeout(60)
        it.connect(("127.0.0.1", server.port))
        it.sendall(server.request(lines))
        yield it


def rest(it: socket.socket, pause: float = 0) -> bytes:
    """All that comes until the server has ended the connection."""
    found = bytearray()
    try:
        while more := it.recv(2**16):
            found += more
            time.sleep(pause)
    except ConnectionResetError:
        pass
    return bytes(found)


@pytest.mark.parametrize(
    "begun",
    [
        "",
        "GET /api/stu",
        "GET / HTTP/1.1\nHost: 127.0.0.1:PORT\n",
        "POST /api/validate HTTP/1.1\nHost: 127.0.0.1:PORT\nCookie: COOKIE\nContent-Length: 9\n\n{",
    ],
)
def test_who_never_ends_a_request_is_cut_off(impatient: LabServer, begun: str) -> None:
    with client(impatient, begun) as it:
        assert rest(it) == b""


RECORDING = (
    f"GET /api/recording?{urlencode(SMALL)} HTTP/1.1\nHost: 127.0.0.1:PORT\nCookie: COOKIE\n"
)
MANY = (
    f"{RECORDING}\n" * 99 + f"{RECORDING}Connection: close\n\n"
)  # answers of 90 kB each, more than a kernel keeps for a client


def test_who_does_not_take_an_answer_is_cut_off(impatient: LabServer) -> None:
    assert (
        get_response(impatient.address, "recording", **SMALL).status_code == 200
    )  # so that the others are there at once

    def taken_after(pause: float) -> int:
        with client(impatient, MANY) as it:
            time.sleep(pause)
            return rest(it).count(b"HTTP/1.1 200 OK")

    assert any(
        taken_after(pause) < 100 for pause in (1.5, 6, 24)
    )  # a busy machine takes its time before it waits for a client


def test_who_takes_an_answer_slowly_gets_all_of_it(impatient: LabServer) -> None:
    with client(impatient, MANY) as it:
        assert rest(it, pause=0.001).count(b"HTTP/1.1 200 OK") == 100


def test_a_page_that_only_listens_is_not_cut_off(impatient: LabServer) -> None:
    order = {
        "experiment": shorten_preset().replace(evolution={"generations": 1000}).to_dict(),
        "seconds": SOON,
    }
    id = CLIENT.post(f"{impatient.address}/api/live", json=order).json()["id"]
    with impatient.websocket(f"/api/live/{id}") as page:
        until = time.monotonic() + 5 * SOON
        while time.monotonic() < until:
            page.recv(timeout=10)
        page.send('{"do": "stop"}')


def test_there_are_only_so_many_connections_and_the_others_are_told(impatient: LabServer) -> None:
    with ExitStack() as many:

        def asked_among_many() -> httpx.Response:
            for _ in range(20):
                many.enter_context(client(impatient, ""))
            return CLIENT.get(f"{impatient.address}/api/studies")

        answers = (
            asked_among_many() for _ in range(10)
        )  # on a busy machine the first may be cut off before the last is there
        answer = next(answer for answer in answers if answer.status_code == 503)
        assert answer.json()["error"].endswith("open connections; close some of its pages")
        time.sleep(2 * SOON)
        assert CLIENT.get(f"{impatient.address}/api/studies").status_code == 200


@pytest.mark.parametrize("path", ["validate", "schema", "appearance", "live", "live/1/save"])
def test_what_is_posted_is_bounded_in_size_and_depth(lab_server: LabServer, path: str) -> None:
    address = f"{lab_server.address}/api/{path}"
    large = CLIENT.post(address, content=b" " * (MAX_BODY_SIZE + 1))
    assert large.status_code == 413
    assert large.json()["error"] == f"/api/{path}: the body may have at most 1,048,576 bytes"
    for depth in (33, 2000, 100_000):
        deep = CLIENT.post(address, content='{"a":' * depth + "1" + "}" * depth)
        assert (deep.status_code, deep.json()["error"]) == (
            400,
            "JSON may have 32 nested levels; this text has more",
        )
