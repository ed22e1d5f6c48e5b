"""Dask schedulers and workers as processes on this machine."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
from distributed import Client


class Process:
    """A Dask process and its children."""

    def __init__(self, *words: str) -> None:
        self._popen = subprocess.Popen(
            [sys.executable, "-m", "dask", *words], stderr=subprocess.DEVNULL
        )
        self._process = psutil.Process(self._popen.pid)

    def cpu(self) -> float:
        """Return the CPU time in seconds."""
        processes = (self._process, *self._process.children(recursive=True))
        times = [process.cpu_times() for process in processes]
        return sum(time.user + time.system for time in times)

    def mib(self) -> float:
        """Return the resident memory in MiB."""
        return float(self._process.memory_info().rss) / 2**20

    def end(self) -> None:
        """Terminate the process."""
        self._popen.terminate()
        self._popen.wait()


@contextmanager
def scheduler() -> Iterator[tuple[Process, str]]:
    """Start a Dask scheduler on loopback, and yield its process and address."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scheduler.json"
        words = (
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--no-dashboard",
            "--scheduler-file",
            str(file),
        )
        process = Process("scheduler", *words)
        try:
            while not file.exists():
                time.sleep(0.05)
            time.sleep(0.2)
            yield process, json.loads(file.read_text())["address"]
        finally:
            process.end()


@contextmanager
def workers(address: str, count: int) -> Iterator[list[Process]]:
    """Start `count` worker processes with one thread each."""
    words = ("--host", "127.0.0.1", "--nthreads", "1", "--no-dashboard", "--no-nanny")
    started = [Process("worker", address, *words) for _ in range(count)]
    try:
        with Client(address, set_as_default=False) as client:
            client.wait_for_workers(count)
        yield started
    finally:
        for process in started:
            process.end()
