"""The command `baldwinlab lab`."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
import webbrowser
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from io import StringIO
from pathlib import Path

import httpx
import psutil
import pytest
from rich.console import Console

from baldwinlab import cli
from baldwinlab.cli import lab
from baldwinlab.core import console
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.lab.access import Access
from baldwinlab.papers.presets import load
from tests.lab.client import CLIENT, LabServer
from tests.small_studies import make_small_study, shorten_preset


def refusal_message(
    arguments: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> str:
    """Run the command, require exit code 2, and return the error message."""
    monkeypatch.setattr(sys, "argv", ["baldwinlab", "lab", "--no-browser", *arguments])
    with pytest.raises(SystemExit) as error:
        cli.main()
    assert error.value.code == 2
    return capsys.readouterr().err


def test_a_port_in_use_is_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with lab.open_listener(0) as listener:
        port = listener.getsockname()[1]
        message = refusal_message(["--port", str(port)], capsys, monkeypatch)
    assert message == (
        f"baldwinlab: port {port} is in use, perhaps by another lab. "
        "Choose another port with --port.\n"
    )


def test_an_invalid_port_is_refused(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    message = refusal_message(["--port", "65536"], capsys, monkeypatch)
    assert message == "baldwinlab: --port 65536 must be from 0 to 65535\n"


def test_an_invalid_root_path_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for path in ("lab", "http://hub/lab", "/a//b", "/a?b", "/a b"):
        message = refusal_message([str(tmp_path), "--root-path", path], capsys, monkeypatch)
        assert message.startswith(f"baldwinlab: --root-path {path} must be the path of the proxy")
    paths = ["/", "/lab/", "/user/ada@x.org/proxy/8642"]
    assert [lab.read_root_path(path) for path in paths] == ["", "/lab", paths[2]]


def test_a_missing_folder_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    message = refusal_message([str(tmp_path / "none")], capsys, monkeypatch)
    assert message.startswith(f"baldwinlab: {tmp_path / 'none'} does not exist")


def test_without_its_extra_the_lab_prints_the_installation_command(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lab, "find_spec", lambda name: None)
    message = refusal_message([], capsys, monkeypatch)
    assert message == f"baldwinlab: {missing_extra_error('lab', 'the lab')}\n"


def test_the_lab_listens_only_on_the_loopback_address() -> None:
    with lab.open_listener(0) as listener:
        assert listener.getsockname()[0] == "127.0.0.1"


def test_the_browser_is_opened_unless_the_option_disables_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    addresses: list[str] = []
    monkeypatch.setattr(webbrowser, "open", addresses.append)
    served: list[Access] = []
    monkeypatch.setattr(lab, "_serve", lambda *_, access, **__: served.append(access))
    lab.lab(tmp_path, port=0, browser=False)
    assert (len(served), addresses) == (1, [])
    lab.lab(tmp_path, port=0)
    assert len(served) == 2
    (address,) = addresses
    token = httpx.URL(address).params["token"]
    assert address.startswith("http://127.0.0.1:")
    assert token != served[1].token
    # The token is valid once, because other users can read the command line of the browser.
    assert served[1].accept(token)
    assert not served[1].accept(token)


def test_a_narrow_terminal_does_not_break_the_printed_address(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    served = list[Access]()
    printed = StringIO()
    monkeypatch.setattr(lab, "_serve", lambda *_, access, **__: served.append(access))
    monkeypatch.setattr(
        console, "console", Console(width=40, file=printed, force_terminal=True, highlight=False)
    )
    lab.lab(tmp_path, port=0, browser=False)
    assert f"/?token={served[0].token} and shows" in printed.getvalue()


@contextmanager
def start_lab(root: Path) -> Iterator[tuple[subprocess.Popen[str], LabServer]]:
    """Start the command in a process and yield the process and the server."""
    command = [sys.executable, "-m", "baldwinlab", "lab", str(root), "--port", "0", "--no-browser"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        server = LabServer.from_output(
            root, next(line for line in process.stdout if "is open at" in line)
        )
        server.admit_client()
        try:
            yield process, server
        finally:
            process.terminate()


@pytest.mark.skipif(
    sys.platform == "win32", reason="there, ctrl-C cannot be sent to a single process"
)
def test_ctrl_c_closes_the_lab(tmp_path: Path) -> None:
    with start_lab(tmp_path) as (process, server), httpx.Client(timeout=300) as client:
        assert client.get(server.entry).status_code == 303
        # The connection of the client stays open.
        assert client.get(f"{server.address}/api/studies").json() == {"studies": []}
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate()
    assert (process.returncode, errors) == (0, "")
    assert output.endswith("The lab is closed.\n")


def attach_client(server: LabServer, client_kind: str) -> ExitStack:
    """Open a connection that stays open until the end of the `with` statement."""
    connections = ExitStack()
    if client_kind == "a page that watches and does not read":
        request = {
            "experiment": shorten_preset("evo/A")
            .replace(evolution={"generations": 10_000})
            .to_dict()
        }
        run_id = CLIENT.post(f"{server.address}/api/live", json=request).json()["id"]
        connections.enter_context(server.websocket(f"/api/live/{run_id}", close_timeout=0))
        return connections
    head = "POST /api/validate HTTP/1.1\nHost: 127.0.0.1:PORT\nCookie: COOKIE\n"
    incomplete_requests = {"half a request": f"{head}Content-Length: 9\n\n{{"}
    # The server simulates 99 generations for this request.
    query = "preset=evo%2Bself-taught/A&seed=0&run=0&generation=99"
    recording_request = (
        f"GET /api/recording?{query} HTTP/1.1\nHost: 127.0.0.1:PORT\nCookie: COOKIE\n\n"
    )
    client = connections.enter_context(socket.create_connection(("127.0.0.1", server.port)))
    client.sendall(server.request(incomplete_requests.get(client_kind, recording_request)))
    return connections


def wait_for_work(process: subprocess.Popen[str]) -> None:
    """Wait until a server has computed for 0.1 s, which requests alone do not need."""
    server = psutil.Process(process.pid)
    before = server.cpu_times().user
    while server.cpu_times().user < before + 0.1:
        time.sleep(0.05)


@pytest.mark.skipif(
    sys.platform == "win32", reason="there, ctrl-C cannot be sent to a single process"
)
@pytest.mark.parametrize(
    "client_kind",
    [
        "a life that takes long",
        pytest.param("a page that watches and does not read", marks=pytest.mark.nightly),
        pytest.param("half a request", marks=pytest.mark.nightly),
    ],
)
def test_ctrl_c_closes_the_lab_with_any_open_connection(tmp_path: Path, client_kind: str) -> None:
    with start_lab(tmp_path) as (process, server):
        while not CLIENT.get(f"{server.address}/api/engine").json()["ready"]:
            time.sleep(0.1)
        with attach_client(server, client_kind):
            if client_kind != "half a request":
                wait_for_work(process)
            process.send_signal(signal.SIGINT)
            output, errors = process.communicate()
    assert (process.returncode, errors) == (0, "")
    assert output.endswith("The lab is closed.\n")


# The test makes many recordings, so that a memory leak is visible.
@pytest.mark.nightly
def test_many_recordings_do_not_increase_memory(tmp_path: Path) -> None:
    """The cache is full after the first recordings. The others have 150 MB in total."""
    crowd = {
        "population": {"size": 2000},
        "lifetime": {"steps": 1000},
        "evolution": {"generations": 1},
    }
    make_small_study(tmp_path / "crowd", [load("evo/A").replace(**crowd)], runs=1)
    with start_lab(tmp_path) as (process, server):
        memory = []
        for last in range(988, 1000):
            query = f"study=crowd&condition=evo/A&run=0&generation=0&last={last}"
            assert len(CLIENT.get(f"{server.address}/api/recording?{query}").content) > 25e6
            memory.append(psutil.Process(process.pid).memory_info().rss)
    assert memory[-1] - memory[5] < 60e6
