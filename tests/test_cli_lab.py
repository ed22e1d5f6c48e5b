"""The command `baldwinlab lab`."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import webbrowser
from pathlib import Path

import httpx
import pytest

from baldwinlab import cli
from baldwinlab.cli import lab


def complaint(arguments: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> str:
    """What the command says when it refuses, with exit code 2."""
    monkeypatch.setattr(sys, "argv", ["baldwinlab", "lab", "--no-browser", *arguments])
    with pytest.raises(SystemExit) as exit:
        cli.main()
    assert exit.value.code == 2
    return capsys.readouterr().err


def test_a_port_in_use_is_named(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    with lab.listening(0) as taken:
        port = taken.getsockname()[1]
        said = complaint(["--port", str(port)], capsys, monkeypatch)
    assert said == f"baldwinlab: port {port} is in use, perhaps by another lab; choose another with --port\n"


def test_a_port_that_cannot_be_is_refused(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    said = complaint(["--port", "65536"], capsys, monkeypatch)
    assert said == "baldwinlab: --port 65536 must be at least 0 and at most 65535\n"


def test_a_folder_that_is_not_there_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said = complaint([str(tmp_path / "none")], capsys, monkeypatch)
    assert said.startswith(f"baldwinlab: {tmp_path / 'none'}: there is no such folder")


def test_without_its_extra_it_says_how_to_get_it(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lab, "find_spec", lambda name: None)
    said = complaint([], capsys, monkeypatch)
    assert said == "baldwinlab: the lab needs the extra 'lab': pip install 'baldwinlab[lab]'\n"


def test_it_listens_on_loopback_only() -> None:
    with lab.listening(0) as listener:
        assert listener.getsockname()[0] == "127.0.0.1"


def test_the_browser_is_opened_unless_told_otherwise(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    served: list[socket.socket] = []
    monkeypatch.setattr(lab, "_serve", lambda directory, listener: served.append(listener))
    lab.lab(tmp_path, port=0, browser=False)
    assert (len(served), opened) == (1, [])
    lab.lab(tmp_path, port=0)
    assert len(served) == 2
    assert opened[0].startswith("http://127.0.0.1:")


@pytest.mark.skipif(sys.platform == "win32", reason="there, ctrl-C cannot be sent to a single process")
def test_ctrl_c_closes_it(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "baldwinlab", "lab", str(tmp_path), "--port", "0", "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    said = next(line for line in process.stdout if "is open at" in line)
    address = said.split("is open at ")[1].split()[0]
    with httpx.Client() as client:  # its connection stays open
        assert client.get(f"{address}api/studies").json() == {"studies": []}
        process.send_signal(signal.SIGINT)
        rest, complaints = process.communicate(timeout=30)
    assert (process.returncode, rest, complaints) == (0, "the lab is closed\n", "")
