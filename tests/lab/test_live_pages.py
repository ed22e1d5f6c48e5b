"""Tests of the messages between pages and live runs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from websockets.sync.client import ClientConnection

from baldwinlab.simulation.simulate import simulate
from tests.lab.client import CLIENT, LabServer
from tests.lab.conftest import run_server
from tests.small_studies import shorten_preset

LONG = {"evolution": {"generations": 1000}, "lifetime": {"steps": 50}}
# Seconds per generation, so that a test can stop a run before its end.
PACE = 0.02


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    with run_server(tmp_path_factory.mktemp("saved")) as opened:
        yield opened


def post(server: LabServer, path: str, body: Any) -> tuple[int, Any]:
    """Post a body, as JSON unless it is text. Return the status and the JSON of the response."""
    response = CLIENT.post(
        f"{server.address}/api/{path}", content=body if isinstance(body, str) else json.dumps(body)
    )
    return response.status_code, response.json()


def start_live_run(server: LabServer, **request: Any) -> str:
    """Start a live run and return its ID."""
    status, response = post(
        server, "live", {"experiment": shorten_preset().to_dict(), "runs": 2, "seed": 5, **request}
    )
    assert status == 201, response
    return str(response["id"])


def connect_page(server: LabServer, id: str) -> ClientConnection:
    return server.websocket(f"/api/live/{id}")


def receive(session: ClientConnection) -> dict[str, Any]:
    message: dict[str, Any] = json.loads(session.recv(timeout=300))
    return message


def receive_until(
    session: ClientConnection, until: str, first: int = 0
) -> tuple[list[float], list[str]]:
    """Receive messages up to a state.

    Return the best fitness of each generation from `first` on, and the states.
    """
    best: list[float] = []
    states: list[str] = []
    while until not in states:
        message = receive(session)
        if message["type"] == "generations":
            assert message["first"] == len(best) + first
            best += message["best"]["mean"]
        elif message["type"] == "state":
            states.append(message["state"])
    return best, states


def test_simultaneous_and_later_pages_receive_the_same_generations(server: LabServer) -> None:
    id = start_live_run(server)
    with connect_page(server, id) as first, connect_page(server, id) as second:
        assert receive(first)["experiment"] == shorten_preset().to_dict()
        both = [receive_until(first, "done")[0], receive_until(second, "done")[0]]
    with connect_page(server, id) as late:
        best, states = receive_until(late, "done")
    assert both == [best, best]
    assert states == ["done"]
    runs = [
        simulate(shorten_preset(), seed=5, run=run).energy.max("agent").values for run in (0, 1)
    ]
    assert np.allclose(best, np.mean(runs, axis=0))


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (
            {"experiment": {"lifetime": {"steps": 0}}},
            "lifetime.steps = 0: input should be greater than or equal to 1",
        ),
        ({"experiment": {}, "runs": "two"}, "runs = 'two' must be a whole number"),
        ({"experiment": {}, "seed": -1}, "seed = -1 must be a whole number from 0 to 2147483647"),
        (
            {"experiment": {}, "seconds": 1e9},
            "seconds = 1000000000.0 must be a number from 0 to 60",
        ),
        ("{", "/api/live needs a JSON object"),
        (
            {"a": {}},
            "/api/live has no field 'a'; it reads experiment, runs, seed, seconds",
        ),
    ],
)
def test_an_invalid_live_run_is_rejected_with_a_message(
    server: LabServer, body: Any, message: str
) -> None:
    assert post(server, "live", body) == (400, {"error": message})


def test_an_unknown_command_for_a_live_run_returns_a_message(
    server: LabServer,
) -> None:
    command = json.dumps({"command": "explode"})
    with connect_page(server, start_live_run(server)) as session:
        receive_until(session, "done")
        session.send(b"\xff\x00")
        assert receive(session)["type"] == "problem"
        session.send(command.encode())
        assert "not 'explode'" in receive(session)["message"]
        session.send(command)
        message = receive(session)["message"]
    assert message == "the command of a live run must be pause, resume, stop or pace, not 'explode'"
