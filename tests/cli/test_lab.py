"""The command `baldwinlab lab`."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path

import httpx
import psutil
import pytest
from rich.console import Console

from baldwinlab.cli import lab
from baldwinlab.core import console
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.lab.server.access import Access
from baldwinlab.papers.presets import load
from tests.commands import Command
from tests.lab.client import CLIENT, LabServer
from tests.small_studies import make_small_study, shorten_preset


def test_the_lab_listens_on_the_loopback_address_and_names_a_port_in_use(command: Command) -> None:
    with lab.open_listener(0) as listener:
        host, port = listener.getsockname()
        assert host == "127.0.0.1"
        refused = command("lab", "--no-browser", "--port", str(port))
    assert (refused.code, refused.err) == (
        2,
        f"baldwinlab: port {port} is in use, perhaps by another lab. "
        "Choose another port with --port.\n",
    )


def test_a_root_path_has_no_slash_at_its_end() -> None:
    paths = ["/", "/lab/", "/user/ada@x.org/proxy/8642"]
    assert [lab.read_root_path(path) for path in paths] == ["", "/lab", paths[2]]


def test_without_its_extra_the_lab_prints_the_installation_command(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lab, "find_spec", lambda name: None)
    message = f"baldwinlab: {missing_extra_error('lab', 'the lab')}\n"
    assert command("lab", "--no-browser") == (2, "", message)


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


def test_the_lab_of_the_present_folder_prints_the_path_of_this_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    printed = StringIO()
    monkeypatch.setattr(lab, "_serve", lambda *_, **__: None)
    monkeypatch.setattr(console, "console", Console(width=1000, file=printed))
    monkeypatch.chdir(tmp_path)
    lab.lab(Path(), port=0, browser=False)
    assert f" and shows {tmp_path.resolve()}. Ctrl-C closes it." in printed.getvalue()


# The pauses of the lab end the functions that prepare the first page.
FIRST_LIFETIME = """
import sys, time
from contextlib import suppress
from pathlib import Path
from baldwinlab.cli import lab
from baldwinlab.lab import Lab
from baldwinlab.lab.server import app
from baldwinlab.lab.sources import history, live, recording, results, studies

class PauseError(Exception):
    pass

def pause(seconds):
    raise PauseError

time.sleep = pause
lab._warm_up()
with suppress(PauseError):
    lab._preload()
imported = set(sys.modules)
state = Lab(Path(sys.argv[1]).resolve(), live.Live())
condition = {"study": ".", "condition": "evo/A"}
run = condition | {"run": "0"}
studies.list_studies(state, {})
results.load_typical_run(state, condition)
history.load_fitness_curve(state, run)
recording.load_recording(state, run | {"generation": "2"})
print("scipy.stats" in sys.modules, *{name.split(".")[0] for name in set(sys.modules) - imported})
"""


def test_the_first_lifetime_waits_for_no_pause_and_no_import(tmp_path: Path) -> None:
    """The engine and the imports of the first lifetime begin with the server, not before a page."""
    # The name of a changed map is found among the maps of all papers, which takes more imports.
    experiment = shorten_preset("evo/A").replace(world=load("evo/A").world)
    make_small_study(tmp_path, [experiment], runs=1)
    process = subprocess.run(
        [sys.executable, "-c", FIRST_LIFETIME, str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
    )
    has_statistics, *packages = process.stdout.splitlines()[-1].split()
    assert has_statistics == "False"
    assert not {"baldwinlab", "dask", "numba", "pandas", "scipy"} & set(packages)


# Windows cannot send ctrl-C to a single process.
needs_ctrl_c = pytest.mark.skipif(sys.platform == "win32", reason="the platform has no ctrl-C")


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


@needs_ctrl_c
def test_ctrl_c_closes_the_lab(tmp_path: Path) -> None:
    with start_lab(tmp_path) as (process, server), httpx.Client(timeout=300) as client:
        assert client.get(server.entry).status_code == 303
        # The connection of the client stays open.
        assert client.get(f"{server.address}/api/studies").json() == {"studies": []}
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate()
    assert (process.returncode, errors) == (0, "")
    assert output.endswith("The lab is closed.\n")


@contextmanager
def attach_client(server: LabServer, client_kind: str) -> Iterator[None]:
    """Open a connection that stays open until the end of the `with` statement."""
    if client_kind == "a page that watches and does not read":
        experiment = shorten_preset("evo/A").replace(evolution={"generations": 10_000})
        request = {"experiment": experiment.to_dict()}
        run_id = CLIENT.post(f"{server.address}/api/live", json=request).json()["id"]
        with server.websocket(f"/api/live/{run_id}", close_timeout=0):
            yield
        return
    head = "HTTP/1.1\nHost: 127.0.0.1:PORT\nCookie: COOKIE\n"
    # The server simulates 99 generations for this request.
    query = "preset=evo%2Bself-taught/A&seed=0&run=0&generation=99"
    request_lines = f"GET /api/recording?{query} {head}\n"
    if client_kind == "half a request":
        request_lines = f"POST /api/validate {head}Content-Length: 9\n\n{{"
    with socket.create_connection(("127.0.0.1", server.port)) as client:
        client.sendall(server.request(request_lines))
        yield


def wait_for_work(process: subprocess.Popen[str]) -> None:
    """Wait until a server has computed for 0.1 s, which requests alone do not need."""
    server = psutil.Process(process.pid)
    before = server.cpu_times().user
    while server.cpu_times().user < before + 0.1:
        time.sleep(0.05)


@needs_ctrl_c
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
