"""Who may ask, and where a server's reach ends."""

from __future__ import annotations

import shutil
import socket
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from websockets.exceptions import InvalidStatus
from websockets.typing import Origin

from baldwinlab.lab import Lab, studies
from tests.lab.client import CLIENT, SMALL, LabServer, get_error, get_json, get_response
from tests.lab.conftest import run_server
from tests.small_studies import shorten_preset


def raw(server: LabServer, lines: str) -> tuple[int, str]:
    """What a server answers to its owner's request of these lines: status and all that follows. PORT stands for its port."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=10) as connection:
        connection.sendall(
            server.request(f"{lines.strip()}\nCookie: COOKIE\nConnection: close\n\n")
        )
        answer = b"".join(iter(lambda: connection.recv(65536), b"")).decode("utf-8", "replace")
    return int(answer.split(" ")[1]), answer


def test_the_page_is_served_and_may_load_nothing_from_elsewhere(lab_server: LabServer) -> None:
    answer = CLIENT.get(lab_server.address)
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/html")
    policy = answer.headers["content-security-policy"]
    assert policy.startswith(
        "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'"
    )
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"
    assert get_response(lab_server.address, "studies").headers["cache-control"] == "no-store"


@pytest.mark.parametrize("host", ["127.0.0.1:PORT", "localhost:PORT", "[::1]:PORT"])
def test_it_answers_to_the_names_of_loopback(lab_server: LabServer, host: str) -> None:
    assert raw(lab_server, f"GET /api/studies HTTP/1.1\nHost: {host}")[0] == 200
    assert (
        raw(lab_server, f"GET /api/studies HTTP/1.1\nHost: {host}\nOrigin: http://{host}")[0] == 200
    )


@pytest.mark.parametrize(
    "host", ["evil.org", "evil.org:PORT", "127.0.0.1", "127.0.0.1:1", "localhost.evil.org:PORT", ""]
)
def test_a_name_that_was_made_to_point_here_is_refused(lab_server: LabServer, host: str) -> None:
    for path in ("/", "/api/studies"):
        status, answer = raw(lab_server, f"GET {path} HTTP/1.1\nHost: {host}")
        assert status == 403
        assert "is not allowed: use 127.0.0.1:" in answer


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.org",
        "null",
        "https://127.0.0.1:PORT",
        "http://127.0.0.1:1",
        "http://localhost:PORT",
    ],
)
def test_another_origin_is_refused(lab_server: LabServer, origin: str) -> None:
    for method in ("GET", "POST"):
        status, answer = raw(
            lab_server, f"{method} /api/studies HTTP/1.1\nHost: 127.0.0.1:PORT\nOrigin: {origin}"
        )
        assert status == 403
        assert "not allowed to use this server" in answer


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_a_picture_in_another_page_is_refused_but_a_link_to_the_page_is_not(
    lab_server: LabServer, site: str
) -> None:
    lines = f"HTTP/1.1\nHost: 127.0.0.1:PORT\nSec-Fetch-Site: {site}"
    assert raw(lab_server, f"GET /api/studies {lines}")[0] == 403
    assert raw(lab_server, f"GET / {lines}")[0] == 200
    assert (
        raw(
            lab_server,
            "GET /api/studies HTTP/1.1\nHost: 127.0.0.1:PORT\nSec-Fetch-Site: same-origin",
        )[0]
        == 200
    )


@pytest.mark.parametrize("path", ["/api/live/1", "/nowhere"])
def test_a_websocket_of_another_origin_or_name_is_refused(lab_server: LabServer, path: str) -> None:
    with (
        pytest.raises(InvalidStatus) as refused,
        lab_server.websocket(path, origin=Origin("http://evil.org")),
    ):
        pass
    assert refused.value.response.status_code == 403
    upgrade = (
        "Upgrade: websocket\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="
    )
    lines = f"GET {path} HTTP/1.1\nHost: evil.org:PORT\n{upgrade}\nConnection: Upgrade"
    assert raw(lab_server, lines)[0] == 403


def test_a_websocket_that_nobody_answers_is_refused(lab_server: LabServer) -> None:
    with pytest.raises(InvalidStatus) as refused, lab_server.websocket("/nowhere"):
        pass
    assert refused.value.response.status_code == 403


@pytest.mark.parametrize(
    "path",
    [
        "/../__init__.py",
        "/../../../pyproject.toml",
        "/..%2f__init__.py",
        "/%2e%2e/__init__.py",
        "/%2e%2e%2f%2e%2e%2f%2e%2e%2fpyproject.toml",
        "//etc/passwd",
        "/..%5c__init__.py",
        "/static/nothing.js",
    ],
)
def test_no_file_outside_of_the_page_is_served(lab_server: LabServer, path: str) -> None:
    status, answer = raw(lab_server, f"GET {path} HTTP/1.1\nHost: 127.0.0.1:PORT")
    assert status == 404
    assert '{"error":"there is no /' in answer


@pytest.fixture
def walled(lab_server: LabServer, tmp_path: Path) -> Path:
    """A folder `inside` beside one study, with links to that study and to parts of it."""
    shutil.copytree(lab_server.root / "small", tmp_path / "outside")
    inside = tmp_path / "inside"
    shutil.copytree(lab_server.root / "small", inside / "own")
    (inside / "link").symlink_to(tmp_path / "outside")
    (inside / "runs-elsewhere").mkdir()
    shutil.copy(inside / "own" / "study.toml", inside / "runs-elsewhere")
    (inside / "runs-elsewhere" / "runs").symlink_to(tmp_path / "outside" / "runs")
    record = inside / "own" / "runs" / "evo" / "A" / "0000.nc"
    record.unlink()
    record.symlink_to(tmp_path / "outside" / "runs" / "evo" / "A" / "0000.nc")
    return inside


@pytest.mark.parametrize(
    "study",
    [
        "../outside",
        "own/../../outside",
        "{outside}",
        "link",
        "runs-elsewhere",
        "../inside/link",
        "own/../link",
    ],
)
def test_a_study_outside_of_the_folder_is_refused(walled: Path, study: str) -> None:
    named = study.format(outside=walled.parent / "outside")
    with run_server(walled) as server:
        for path in ("recording", "results", "experiment"):
            answer = get_response(server.address, path, **(SMALL | {"study": named}))
            assert answer.status_code == 400
            assert "is outside" in answer.json()["error"]


def test_a_condition_whose_name_leads_outside_is_refused(walled: Path) -> None:
    (walled / "sly" / "runs").mkdir(parents=True)
    name = "../../../outside/runs/evo/A"
    (walled / "sly" / "study.toml").write_text(f'format = 1\nseed = 5\nconditions = ["{name}"]')
    with run_server(walled) as server:
        query = {"study": "sly", "condition": name, "run": 0, "generation": 0}
        assert "is no name of a condition" in get_error(server.address, "recording", 400, **query)
        (problem,) = [
            study["problem"]
            for study in get_json(server.address, "studies")["studies"]
            if study["id"] == "sly"
        ]
        assert "is no name of a condition" in problem


def test_a_name_that_no_file_can_have_is_no_study(lab_server: LabServer) -> None:
    for name in ("a" * 5000, "\0", "small/study.toml", "small/runs"):
        assert get_error(lab_server.address, "results", 404, study=name).startswith(
            "there is no study"
        )


def test_a_record_outside_of_the_folder_is_refused_and_the_others_served(walled: Path) -> None:
    with run_server(walled) as server:
        query = {"study": "own", "condition": "evo/A", "generation": 0}
        assert "0000.nc is outside" in get_error(server.address, "recording", 400, run=0, **query)
        assert "0000.nc is outside" in get_error(server.address, "results", 400, study="own")
        assert get_response(server.address, "recording", run=1, **query).status_code == 200
        assert [study["id"] for study in get_json(server.address, "studies")["studies"]] == [
            "own",
            "runs-elsewhere",
        ]


def test_two_who_ask_at_once_get_the_same(lab_server: LabServer) -> None:
    with ThreadPoolExecutor(8) as pool:
        wanted = [
            dict(SMALL, generation=generation, last=250 + generation) for generation in range(3)
        ] * 4
        answers = list(
            pool.map(lambda query: get_response(lab_server.address, "recording", **query), wanted)
        )
    for answer, query in zip(answers, wanted, strict=True):
        assert answer.status_code == 200
        assert answer.content == get_response(lab_server.address, "recording", **query).content


def test_what_nobody_foresaw_is_a_sentence_too_and_the_server_goes_on(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(lab: Lab, name: str) -> bytes:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(studies, "results_of", fail)
        sentence = get_error(lab_server.address, "results", 500, study="small")
    assert sentence == "the lab failed at /api/results: [Errno 28] No space left on device"
    assert get_json(lab_server.address, "results", study="small")["claims"] == []


def test_live_runs_end_with_the_server(lab_server: LabServer) -> None:
    with run_server(lab_server.root) as server:
        experiment = {
            "experiment": shorten_preset().replace(evolution={"generations": 10_000}).to_dict()
        }
        started = CLIENT.post(f"{server.address}/api/live", json=experiment)
        name = f"live {started.json()['id']}"
        (thread,) = [thread for thread in threading.enumerate() if thread.name == name]
    thread.join(30)
    assert not thread.is_alive()
