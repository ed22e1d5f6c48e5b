"""Studies that wait in the middle of their work, so that a test can stop them."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

PAUSED_COMMAND = """
import sys
from pathlib import Path
import pytest
from baldwinlab.simulation import memory
from tests.paused_studies import pause_writes
memory.MAX_RUNS_PER_FILE = 1
pause_writes(pytest.MonkeyPatch(), Path(sys.argv.pop(1)), int(sys.argv.pop(1)))
"""


def pause_writes(patch: pytest.MonkeyPatch, directory: Path, n_records: int) -> None:
    """Let threads wait before they write a file once a folder contains `n_records` records.

    The threads continue when a pool of threads is shut down. The main thread never waits.
    """
    flush = os.fsync
    shut_down = ThreadPoolExecutor.shutdown
    is_ending = threading.Event()

    def wait_and_flush(handle: int) -> None:
        is_worker = threading.current_thread() is not threading.main_thread()
        if is_worker and count_records(directory) >= n_records:
            is_ending.wait()
        flush(handle)

    def resume_and_shut_down(pool: ThreadPoolExecutor, *arguments: Any, **options: Any) -> None:
        is_ending.set()
        shut_down(pool, *arguments, **options)

    patch.setattr(os, "fsync", wait_and_flush)
    patch.setattr(ThreadPoolExecutor, "shutdown", resume_and_shut_down)


@dataclass(frozen=True)
class WaitForFile:
    """Callback of a run that waits after its second generation until a file exists."""

    path: Path

    def __call__(self, run: xr.Dataset) -> None:
        while run.sizes["generation"] > 1 and not self.path.exists():
            time.sleep(0.01)


def count_records(directory: Path) -> int:
    return sum(1 for _ in directory.rglob("*.nc"))


@contextmanager
def run_until_paused(
    code: str, directory: Path, n_records: int, arguments: Sequence[str] = (), **options: Any
) -> Iterator[subprocess.Popen[str]]:
    """Yield a Python process that waits because a folder contains `n_records` records.

    The process stores each run in a separate file.
    """
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
    command = [sys.executable, "-c", PAUSED_COMMAND + code, str(directory), str(n_records)]
    with subprocess.Popen([*command, *arguments], env=environment, text=True, **options) as process:
        try:
            while count_records(directory) < n_records:
                assert process.poll() is None, "the process ended too early"
                time.sleep(0.005)
            yield process
        finally:
            process.kill()
