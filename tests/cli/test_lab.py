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
from baldwinlab.core.extras import missing_extra
from baldwinlab.lab.access import Access
from baldwinlab.papers.presets import load
from tests.lab.client import CLIENT, LabServer
from tests.small_studies import make_small_study, shorten_preset


def complaint(
    arguments: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> str:
    """What the command says when it refuses, with exit code 2."""
    monkeypatch.setattr(sys, "argv", ["baldwinlab", "lab", "--no-browser", *arguments])
    with pytest.raises(SystemExit) as exit:
        cli.main()
    assert exit.value.code == 2
    return capsys.readouterr().err


def test_a_port_in_use_is_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with lab.listening(0) as taken:
        port = taken.getsockname()[1]
        said = complaint(["--port", str(port)], capsys, monkeypatch)
    assert (
        said
        == f"baldwinlab: port {port} is in use, perhaps by another lab. Choose another port with --port.\n"
    )


def test_a_port_that_cannot_be_is_refused(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said = complaint(["--port", "65536"], capsys, monkeypatch)
    assert said == "baldwinlab: --port 65536 must be from 0 to 65535\n"


def test_a_folder_that_is_not_there_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said = complaint([str(tmp_path / "none")], capsys, monkeypatch)
    assert said.startswith(f"baldwinlab: {tmp_path / 'none'} does not exist")


def test_without_its_extra_it_says_how_to_get_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lab, "find_spec", lambda name: None)
    said = complaint([], capsys, monkeypatch)
    assert said == f"baldwinlab: {missing_extra('lab', 'the lab')}\n"


def test_it_listens_on_loopback_only() -> None:
    with lab.listening(0) as listener:
        assert listener.getsockname()[0] == "127.0.0.1"


def test_the_browser_is_opened_unless_told_otherwise(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    served: list[Access] = []
    monkeypatch.setattr(lab, "_serve", lambda directory, listener, access: served.append(access))
    lab.lab(tmp_path, port=0, browser=False)
    assert (len(served), opened) == (1, [])
    lab.lab(tmp_path, port=0)
    assert len(served) == 2
    token = httpx.URL(opened[0]).params["token"]
    assert opened[0].startswith("http://127.0.0.1:") and token != served[1].token
    assert served[1].admits(token) and not served[1].admits(
        token
    )  # others may read the browser's command line


def test_the_printed_address_stays_in_one_piece_on_a_narrow_terminal(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    served, printed = list[Access](), StringIO()
    monkeypatch.setattr(lab, "_serve", lambda directory, listener, access: served.append(access))
    monkeypatch.setattr(
        console, "console", Console(width=40, file=printed, force_terminal=True, highlight=False)
    )
    lab.lab(tmp_path, port=0, browser=False)
    assert f"/?token={served[0].token} and shows" in printed.getvalue()


@contextmanager
def opened(root: Path) -> Iterator[tuple[subprocess.Popen[str], LabServer]]:
    """The command at work in a process of its own, and its lab."""
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
def test_ctrl_c_closes_it(tmp_path: Path) -> None:
    with opened(tmp_path) as (process, server), httpx.Client(timeout=60) as client:
        assert client.get(server.entry).status_code == 303
        assert client.get(f"{server.address}/api/studies").json() == {
            "studies": []
        }  # and its connection stays open
        process.send_signal(signal.SIGINT)
        rest, complaints = process.communicate(timeout=30)
    assert (process.returncode, complaints) == (0, "")
    assert rest.endswith("The lab is closed.\n")


def attached(server: LabServer, what: str) -> ExitStack:
    """Somebody who is there when The lab is closed, until the end of the `with`."""
    many = ExitStack()
    if what == "a page that watches and does not read":
        order = {
            "experiment": shorten_preset("evo/A")
            .replace(evolution={"generations": 10_000})
            .to_dict()
        }
        id = CLIENT.post(f"{server.address}/api/live", json=order).json()["id"]
        many.enter_context(server.websocket(f"/api/live/{id}", close_timeout=0))
        return many
    begun = {
        "half a request": "POST /api/validate HTTP/1.1\nHost: 127.0.0.1:PORT\nCookie: COOKIE\nContent-Length: 9\n\n{"
    }
    query = "preset=evo/A&seed=0&run=0&generation=99"  # for which 99 generations are lived
    whole = f"GET /api/recording?{query} HTTP/1.1\nHost: 127.0.0.1:PORT\nCookie: COOKIE\n\n"
    client = many.enter_context(socket.create_connection(("127.0.0.1", server.port)))
    client.sendall(server.request(begun.get(what, whole)))
    return many


@pytest.mark.skipif(
    sys.platform == "win32", reason="there, ctrl-C cannot be sent to a single process"
)
@pytest.mark.parametrize(
    "what", ["a page that watches and does not read", "half a request", "a life that takes long"]
)
@pytest.mark.parametrize(
    "seconds", [30, pytest.param(3, marks=pytest.mark.nightly, id="3, on an idle machine")]
)
def test_ctrl_c_closes_it_soon_whatever_is_attached(
    tmp_path: Path, what: str, seconds: float
) -> None:
    with opened(tmp_path) as (process, server):
        while not CLIENT.get(f"{server.address}/api/engine").json()["ready"]:
            time.sleep(0.1)
        with attached(server, what):
            time.sleep(1)
            asked = time.monotonic()
            process.send_signal(signal.SIGINT)
            rest, complaints = process.communicate(timeout=30)
            assert time.monotonic() - asked < seconds
    assert (process.returncode, complaints) == (0, "")
    assert rest.endswith("The lab is closed.\n")


@pytest.mark.nightly  # so many lifetimes that growth would show
def test_a_day_of_playing_does_not_grow_its_memory(tmp_path: Path) -> None:
    """Once as much is kept as may be, recordings of 150 MB in all come and go."""
    crowd = {
        "population": {"size": 2000},
        "lifetime": {"steps": 1000},
        "evolution": {"generations": 1},
    }
    make_small_study(tmp_path / "crowd", [load("evo/A").replace(**crowd)], runs=1)
    with opened(tmp_path) as (process, server):
        used = []
        for last in range(988, 1000):
            query = f"study=crowd&condition=evo/A&run=0&generation=0&last={last}"
            assert len(CLIENT.get(f"{server.address}/api/recording?{query}").content) > 25e6
            used.append(psutil.Process(process.pid).memory_info().rss)
    assert used[-1] - used[5] < 60e6
