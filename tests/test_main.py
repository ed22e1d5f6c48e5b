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
@pytest.mark.parametrize("delay", [0.1, 0.3, 0.8, 2.0])
def test_a_command_that_is_stopped_says_so_and_no_more(tmp_path: Path, number: signal.Signals, delay: float) -> None:
    words = ["run", "evo/A", "--runs", "200", "--out", str(tmp_path / "study"), "--workers", "1"]
    process = subprocess.Popen([sys.executable, "-c", STARTED, *words], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stderr is not None
    assert process.stderr.readline() == "began\n"
    time.sleep(delay)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "Traceback" not in err + out
    assert "stopped" in err
    assert len(err.strip().splitlines()) == 1
