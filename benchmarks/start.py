"""Measure the start of the command line: `python -m benchmarks.start` (about a minute).

Each command runs in a new process, alternately with the others, so a ratio is independent of the
load of the machine. The files of the libraries are in the memory of the operating system.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Final, NamedTuple

ROUNDS: Final = 5
RUN: Final = ["run", "evo+self-taught/A", "--runs", "1", "--generations", "2"]


class Usage(NamedTuple):
    """Time of a process in seconds."""

    elapsed: float
    cpu: float


def measure(words: list[str], cache: Path) -> Usage:
    """Run Python with arguments and a folder for machine code.

    Parameters
    ----------
    words : list of str
        Arguments of Python.
    cache : Path
        The folder for machine code.

    Returns
    -------
    Usage
        Time of the process.

    Raises
    ------
    CalledProcessError
        The process failed.
    """
    start = time.perf_counter()
    before = os.times()
    environment = os.environ | {"BALDWINLAB_CACHE": str(cache)}
    subprocess.run([sys.executable, *words], env=environment, check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    cpu = after.children_user + after.children_system
    return Usage(time.perf_counter() - start, cpu - before.children_user - before.children_system)


def measure_round(folder: Path) -> dict[str, Usage]:
    """Return the time of each command, with an empty cache for the first run."""
    cache = folder / "cache"
    command = ["-m", "baldwinlab"]
    return {
        "import baldwinlab": measure(["-c", "import baldwinlab"], cache),
        "baldwinlab --help": measure([*command, "--help"], cache),
        "first run": measure([*command, *RUN, "--out", str(folder / "first")], cache),
        "later run": measure([*command, *RUN, "--out", str(folder / "later")], cache),
    }


def main() -> None:
    """Print the medians of all rounds."""
    rounds = []
    for _ in range(ROUNDS):
        with tempfile.TemporaryDirectory() as folder:
            rounds.append(measure_round(Path(folder)))
    print("| command | elapsed, s | CPU, s |\n| --- | --- | --- |")
    for name in rounds[0]:
        elapsed = statistics.median(usages[name].elapsed for usages in rounds)
        cpu = statistics.median(usages[name].cpu for usages in rounds)
        print(f"| {name} | {elapsed:.2f} | {cpu:.2f} |")


if __name__ == "__main__":
    main()
