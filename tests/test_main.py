"""The command line can be stopped at any moment, by ctrl-C or by a queue, without a traceback."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

STARTED = "import sys; sys.stderr.write('began\\n'); sys.stderr.flush(); from baldwinlab.__main__ import main; main()"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-C", "SIGTERM"])
@pytest.mark.parametrize("delay", [0.1, 0.8, 2.0])
def test_a_command_that_is_stopped_says_so_and_no_more(
    tmp_path: Path, number: signal.Signals, delay: float
) -> None:
    process = _running(tmp_path)
    time.sleep(delay)
    process.send_signal(number)
    _has_stopped(process)


def test_it_is_stopped_also_where_a_module_that_is_loaded_swallows_every_error(
    tmp_path: Path,
) -> None:
    process = _running(tmp_path, "try:\n    time.sleep(2)\nexcept BaseException:\n    pass")
    process.send_signal(signal.SIGTERM)
    _has_stopped(process)


def test_whoever_asks_twice_need_not_wait_until_a_module_is_loaded(tmp_path: Path) -> None:
    process = _running(tmp_path, "time.sleep(1000)")
    process.send_signal(signal.SIGTERM)
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _has_stopped(process)


def _running(folder: Path, slow: str = "") -> subprocess.Popen[str]:
    """A long command that has begun; with what a slow module does that a part imports, that has begun."""
    words = ["run", "evo/A", "--runs", "200", "--out", str(folder / "study"), "--workers", "1"]
    if slow:
        (folder / "slow.py").write_text(
            f"import sys, time\nsys.stderr.write('loading\\n')\nsys.stderr.flush()\n{slow}\n"
        )
        (folder / "part.py").write_text(
            f"import sys\nsys.path.insert(0, {str(folder)!r})\nimport slow\nslow.time.sleep(9)\n"
        )
        words += ["--part", str(folder / "part.py")]
    process = subprocess.Popen(
        [sys.executable, "-c", STARTED, *words],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    for word in ("began\n", *(["loading\n"] if slow else [])):
        assert process.stderr.readline() == word
    return process


def _has_stopped(process: subprocess.Popen[str]) -> None:
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "Traceback" not in err + out
    assert "Interrupted" in err
    assert len(err.strip().splitlines()) == 1
