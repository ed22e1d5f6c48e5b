"""Tests of the server: allowed requests, the files that it reads, and its start."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import anyio
import pytest
from playwright.sync_api import Browser, expect
from starlette.types import Message
from websockets.exceptions import InvalidStatus
from websockets.typing import Origin

from baldwinlab.lab import Lab
from baldwinlab.lab.server.access import Access
from baldwinlab.lab.server.app import make_app
from baldwinlab.lab.sources import results
from tests.lab.client import CLIENT, SMALL, LabServer, get_error, get_json, get_response
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study, shorten_preset


def send_request(server: LabServer, lines: str) -> tuple[int, str]:
    """Send a request of the owner, with PORT replaced. Return the status and the response."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=300) as connection:
        connection.sendall(
            server.request(f"{lines.strip()}\nCookie: COOKIE\nConnection: close\n\n")
        )
        response = b"".join(iter(lambda: connection.recv(65536), b"")).decode("utf-8", "replace")
    return int(response.split(" ")[1]), response


def test_a_page_that_leaves_during_the_handshake_of_a_websocket_is_no_error(
    tmp_path: Path,
) -> None:
    async def receive() -> Message:
        return {"type": "websocket.connect"}

    async def send(message: Message) -> None:
        if message["type"] != "websocket.accept":
            raise OSError("the client has closed the connection")

    access = Access()
    cookie = f"baldwinlab-80={access.token}".encode()
    scope = {
        "type": "websocket",
        "path": "/api/live/1",
        "headers": [(b"host", b"127.0.0.1:80"), (b"cookie", cookie)],
        "query_string": b"",
        "server": ("127.0.0.1", 80),
        "scheme": "ws",
        "subprotocols": [],
    }
    # The browser of another test can hold an event loop in this thread.
    with ThreadPoolExecutor(1) as pool:
        pool.submit(anyio.run, make_app(tmp_path, access), scope, receive, send).result()


def test_the_page_is_served_with_a_policy_against_remote_files(lab_server: LabServer) -> None:
    response = CLIENT.get(lab_server.address)
    assert response.status_code == 200
    assert response.headers["content-type"].startswith("text/html")
    policy = response.headers["content-security-policy"]
    assert policy.startswith(
        "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'"
    )
    assert response.headers["cross-origin-resource-policy"] == "same-origin"
    assert get_response(lab_server.address, "studies").headers["cache-control"] == "no-store"


@pytest.mark.parametrize("host", ["127.0.0.1:PORT", "localhost:PORT", "[::1]:PORT"])
def test_the_names_of_loopback_are_allowed(lab_server: LabServer, host: str) -> None:
    lines = f"GET /api/studies HTTP/1.1\nHost: {host}"
    assert send_request(lab_server, lines)[0] == 200
    assert send_request(lab_server, f"{lines}\nOrigin: http://{host}")[0] == 200


@pytest.mark.parametrize(
    "host", ["evil.org", "evil.org:PORT", "127.0.0.1", "127.0.0.1:1", "localhost.evil.org:PORT", ""]
)
def test_another_host_name_is_rejected(lab_server: LabServer, host: str) -> None:
    for path in ("/", "/api/studies"):
        status, response = send_request(lab_server, f"GET {path} HTTP/1.1\nHost: {host}")
        assert status == 403
        assert "is not allowed: use 127.0.0.1:" in response


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
def test_another_origin_is_rejected(lab_server: LabServer, origin: str) -> None:
    for method in ("GET", "POST"):
        status, response = send_request(
            lab_server, f"{method} /api/studies HTTP/1.1\nHost: 127.0.0.1:PORT\nOrigin: {origin}"
        )
        assert status == 403
        assert "not allowed to use this server" in response


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_a_file_in_another_page_is_rejected_and_a_link_is_allowed(
    lab_server: LabServer, site: str
) -> None:
    lines = "HTTP/1.1\nHost: 127.0.0.1:PORT\nSec-Fetch-Site:"
    assert send_request(lab_server, f"GET /api/studies {lines} {site}")[0] == 403
    assert send_request(lab_server, f"GET / {lines} {site}")[0] == 200
    assert send_request(lab_server, f"GET /api/studies {lines} same-origin")[0] == 200


@pytest.mark.parametrize("path", ["/api/live/1", "/nowhere"])
def test_a_websocket_of_another_origin_or_host_is_rejected(
    lab_server: LabServer, path: str
) -> None:
    with (
        pytest.raises(InvalidStatus) as rejection,
        lab_server.websocket(path, origin=Origin("http://evil.org")),
    ):
        pass
    assert rejection.value.response.status_code == 403
    upgrade = (
        "Upgrade: websocket\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="
    )
    lines = f"GET {path} HTTP/1.1\nHost: evil.org:PORT\n{upgrade}\nConnection: Upgrade"
    assert send_request(lab_server, lines)[0] == 403


def test_an_unknown_websocket_is_rejected(lab_server: LabServer) -> None:
    with pytest.raises(InvalidStatus) as rejection, lab_server.websocket("/nowhere"):
        pass
    assert rejection.value.response.status_code == 403


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
def test_no_file_outside_the_page_is_served(lab_server: LabServer, path: str) -> None:
    status, response = send_request(lab_server, f"GET {path} HTTP/1.1\nHost: 127.0.0.1:PORT")
    assert status == 404
    assert '{"error":"there is no /' in response


@pytest.fixture
def restricted_root(lab_server: LabServer, tmp_path: Path) -> Path:
    """Return the folder of a lab, with links to a study outside the folder."""
    shutil.copytree(lab_server.root / "small", tmp_path / "outside")
    inside = tmp_path / "inside"
    shutil.copytree(lab_server.root / "small", inside / "study")
    (inside / "link").symlink_to(tmp_path / "outside")
    (inside / "linked-runs").mkdir()
    shutil.copy(inside / "study" / "study.toml", inside / "linked-runs")
    (inside / "linked-runs" / "runs").symlink_to(tmp_path / "outside" / "runs")
    record = inside / "study" / "runs" / "evo" / "A" / "0000.nc"
    record.unlink()
    record.symlink_to(tmp_path / "outside" / "runs" / "evo" / "A" / "0000.nc")
    return inside


@pytest.mark.parametrize(
    "study",
    [
        "../outside",
        "study/../../outside",
        "{outside}",
        "link",
        "linked-runs",
        "../inside/link",
        "study/../link",
    ],
)
def test_a_study_outside_the_folder_is_rejected(restricted_root: Path, study: str) -> None:
    name = study.format(outside=restricted_root.parent / "outside")
    with run_server(restricted_root) as server:
        condition = SMALL["condition"]
        for path, query in (
            ("recording", SMALL),
            ("results", {}),
            ("typical", {"condition": condition}),
        ):
            response = get_response(server.address, path, **(query | {"study": name}))
            assert response.status_code == 400
            assert "is outside" in response.json()["error"]


def test_a_condition_name_that_is_a_path_out_of_the_folder_is_rejected(
    restricted_root: Path,
) -> None:
    (restricted_root / "invalid" / "runs").mkdir(parents=True)
    name = "../../../outside/runs/evo/A"
    (restricted_root / "invalid" / "study.toml").write_text(
        f'format = 3\nseed = 5\nconditions = ["{name}"]'
    )
    with run_server(restricted_root) as server:
        query = {"study": "invalid", "condition": name, "run": 0, "generation": 0}
        assert "must be letters, digits, + _ . and -" in get_error(
            server.address, "recording", 400, **query
        )
        (problem,) = [
            study["problem"]
            for study in get_json(server.address, "studies")["studies"]
            if study["id"] == "invalid"
        ]
        assert "must be letters, digits, + _ . and -" in problem


def test_a_record_outside_the_folder_is_rejected_and_other_records_are_served(
    restricted_root: Path,
) -> None:
    with run_server(restricted_root) as server:
        query = {"study": "study", "condition": "evo/A", "generation": 0}
        assert "0000.nc is outside" in get_error(server.address, "recording", 400, run=0, **query)
        assert "0000.nc is outside" in get_error(server.address, "results", 400, study="study")
        assert get_response(server.address, "recording", run=1, **query).status_code == 200
        assert [study["id"] for study in get_json(server.address, "studies")["studies"]] == [
            "link",
            "linked-runs",
            "study",
        ]


def test_simultaneous_requests_have_the_same_response(lab_server: LabServer) -> None:
    with ThreadPoolExecutor(8) as pool:
        queries = [
            dict(SMALL, generation=generation, last=250 + generation) for generation in range(3)
        ] * 4
        responses = list(
            pool.map(lambda query: get_response(lab_server.address, "recording", **query), queries)
        )
    for response, query in zip(responses, queries, strict=True):
        assert response.status_code == 200
        assert response.content == get_response(lab_server.address, "recording", **query).content


def test_an_unexpected_error_returns_a_message_and_the_server_continues(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(lab: Lab, name: str) -> bytes:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(results, "find_study", fail)
        message = get_error(lab_server.address, "results", 500, study="small")
    assert message == "the lab failed at /api/results: [Errno 28] No space left on device"
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


def test_the_server_does_not_import_the_libraries_of_reports() -> None:
    code = "import baldwinlab.lab.server.app, sys; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"scipy.stats", "matplotlib"} & set(loaded)


@pytest.mark.parametrize("view", ["world", "live"])
def test_a_view_that_simulates_waits_for_the_engine(
    browser: Browser, tmp_path: Path, view: str
) -> None:
    make_small_study(tmp_path / "small", runs=1)
    compiled = Event()
    with run_server(tmp_path, compiled.is_set) as server:
        page = server.context(browser, viewport={"width": 390, "height": 844}).new_page()
        # The modules of the view load in the meantime.
        with page.expect_response(f"**/view_{view}.js"):
            page.goto(f"/#/{view}")
        line = page.get_by_text("The lab is starting")
        expect(line).to_be_visible()
        # Results need no engine.
        page.get_by_test_id("tab-results").click()
        expect(page.get_by_test_id("results")).to_be_visible()
        expect(line).to_have_count(0)
        page.get_by_test_id(f"tab-{view}").click()
        expect(line).to_be_visible()
        assert not get_json(server.address, "engine")["ready"]
        compiled.set()
        expect(page.get_by_test_id("world-a" if view == "world" else "live-empty")).to_be_visible()
        expect(line).to_have_count(0)
        page.close()
