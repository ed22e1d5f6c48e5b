"""What pages see of a live run through the server, and what they may ask of it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from websockets.sync.client import ClientConnection

from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.store import StudyStore
from tests.lab.client import CLIENT, LabServer, get_json
from tests.lab.conftest import run_server
from tests.small_studies import shorten_preset

LONG = {"evolution": {"generations": 1000}, "lifetime": {"steps": 50}}
BRISK = 0.02  # seconds a generation: it can be stopped on the way


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    with run_server(tmp_path_factory.mktemp("kept")) as opened:
        yield opened


def post(server: LabServer, path: str, body: Any) -> tuple[int, Any]:
    """The status and the answer; a body that is text goes as it is."""
    answer = CLIENT.post(
        f"{server.address}/api/{path}", content=body if isinstance(body, str) else json.dumps(body)
    )
    return answer.status_code, answer.json()


def begin(server: LabServer, **order: Any) -> str:
    status, answer = post(
        server, "live", {"experiment": shorten_preset().to_dict(), "runs": 2, "seed": 5, **order}
    )
    assert status == 201, answer
    return str(answer["id"])


def watching(server: LabServer, id: str) -> ClientConnection:
    return server.websocket(f"/api/live/{id}")


def hear(session: ClientConnection) -> dict[str, Any]:
    message: dict[str, Any] = json.loads(session.recv(timeout=60))
    return message


def heard(session: ClientConnection, until: str, first: int = 0) -> tuple[list[float], list[str]]:
    """The best of every generation from `first` on, and the states, up to a state."""
    best: list[float] = []
    states: list[str] = []
    while until not in states:
        message = hear(session)
        if message["type"] == "generations":
            assert message["first"] == len(best) + first
            best += message["best"]["mean"]
        elif message["type"] == "state":
            states.append(message["state"])
    return best, states


def test_two_pages_and_one_that_comes_later_get_the_same_generations(server: LabServer) -> None:
    id = begin(server)
    with watching(server, id) as one, watching(server, id) as other:
        assert hear(one)["experiment"] == shorten_preset().to_dict()
        both = [heard(one, "done")[0], heard(other, "done")[0]]
    with watching(server, id) as late:
        best, states = heard(late, "done")
    assert both == [best, best]
    assert states == ["done"]
    runs = [
        simulate(shorten_preset(), seed=5, run=run).energy.max("agent").values for run in (0, 1)
    ]
    assert np.allclose(best, np.mean(runs, axis=0))


def test_a_page_pauses_resumes_and_stops_a_live_run_and_keeps_it(server: LabServer) -> None:
    id = begin(server, experiment=shorten_preset().replace(**LONG).to_dict(), seconds=BRISK)
    with watching(server, id) as session:
        lived = len(heard(session, "running")[0])
        for order, state in (("pause", "paused"), ("resume", "running"), ("stop", "stopped")):
            session.send(json.dumps({"do": order}))
            best, states = heard(session, state, lived)
            assert states == [state]
            lived += len(best)
    assert post(server, f"live/{id}/save", {"name": "mine"}) == (201, {"study": "mine"})
    assert StudyStore(server.root / "mine").runs(shorten_preset().name) == [0, 1]
    with watching(server, id) as session:
        assert hear(session)["saved_as"] == "mine"
    status, answer = post(server, f"live/{id}/save", {"name": "mine"})
    assert (status, "exists already" in answer["error"]) == (400, True)


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        (
            {"experiment": {"lifetime": {"steps": 0}}},
            "lifetime.steps = 0: input should be greater than or equal to 1",
        ),
        ({"experiment": {}, "runs": "two"}, "runs = 'two' must be a whole number"),
        ({"experiment": {}, "seed": -1}, "seed = -1 must be at least 0 and less than 2147483648"),
        (
            {"experiment": {}, "seconds": 1e9},
            "seconds = 1000000000.0 must be a number from 0 to 60",
        ),
        ("{", "/api/live needs a JSON object"),
    ],
)
def test_what_cannot_be_started_is_refused_with_a_sentence(
    server: LabServer, body: Any, sentence: str
) -> None:
    assert post(server, "live", body) == (400, {"error": sentence})


def test_what_a_page_asks_of_a_live_run_wrongly_is_answered_with_a_sentence(
    server: LabServer,
) -> None:
    with watching(server, begin(server)) as session:
        heard(session, "done")
        session.send(json.dumps({"do": "explode"}))
        assert (
            hear(session)["message"]
            == "the command of a live run must be pause, resume, stop or pace, not 'explode'"
        )


def test_a_live_run_that_is_not_there_is_gone(server: LabServer) -> None:
    assert post(server, "live/none/save", {"name": "x"})[0] == 404
    with watching(server, "none") as session:
        assert hear(session)["state"] == "gone"


def test_the_server_lists_its_live_runs_and_checks_experiments(server: LabServer) -> None:
    id = begin(server)
    assert id in [run["id"] for run in get_json(server.address, "live")["runs"]]
    assert post(server, "validate", {"experiment": shorten_preset().to_dict()}) == (
        200,
        {"errors": [], "note": ""},
    )
    _, answer = post(server, "validate", {"experiment": {"motor": {"noise": 2}}})
    assert [error["path"] for error in answer["errors"]] == ["motor.noise"]
