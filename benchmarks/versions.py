"""Compare the speed of the paper's study in two versions: `python benchmarks/versions.py FOLDER`.

FOLDER is a checkout of the older version, for example of `git worktree add FOLDER 999bf75`. Both
versions run in this Python. Each has a process, and they simulate the same runs of the six
conditions in turns, one generation at a time, so that other processes slow both equally.
The measure is CPU time. It includes evolution, and excludes compilation. The script prints the
ratio of the times, new to old, with the 95 % interval of its mean over batches of four runs, and
reports results that differ.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from statistics import fmean, stdev
from typing import Any, NamedTuple

from scipy.stats import t as student_t

NEW_FOLDER = Path(__file__).parent.parent
CONDITIONS = tuple(
    f"{learner}/{map_name}"
    for map_name in "AB"
    for learner in ("evo", "evo+self-taught", "self-taught")
)
RUNS_PER_BATCH = 4
# The worker imports what all versions have. A line of input starts a batch, or a generation of it.
WORKER = """
import hashlib, json, sys, time
try:
    from baldwinlab.papers.presets import load
    from baldwinlab.simulation.simulate import simulate_batch
except ImportError:
    from baldwinlab.presets import load
    from baldwinlab.runs.simulate import simulate_batch

def finish_generation(histories):
    print(time.process_time() - start, flush=True)
    wait()

def wait():
    global start
    sys.stdin.readline()
    start = time.process_time()

for line in sys.stdin:
    task = json.loads(line)
    experiment = load(task["condition"]).replace(evolution={"generations": task["generations"]})
    wait()
    runs = simulate_batch(experiment, 0, task["runs"], after_generation=finish_generation)
    energies = b"".join(run["energy"].values.tobytes() for run in runs)
    print(hashlib.sha256(energies).hexdigest(), flush=True)
"""


class Batch(NamedTuple):
    """Runs of a condition."""

    condition: str
    runs: list[int]
    generations: int


class Version:
    """The process of one version, which ends with the context `running`."""

    def __init__(self, folder: Path, running: ExitStack) -> None:
        self._process: Any = running.enter_context(
            subprocess.Popen(
                [sys.executable, "-c", WORKER],
                cwd=folder,
                env={**os.environ, "PYTHONPATH": str(folder)},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        )
        running.callback(self._process.kill)

    def begin(self, batch: Batch) -> None:
        self._send(json.dumps(batch._asdict()))

    def measure_generation(self) -> float:
        """Simulate a generation, and return the seconds of CPU time."""
        self._send("")
        return float(self._process.stdout.readline())

    def finish(self) -> str:
        """Return a digest of the energies of all agents."""
        self._send("")
        return str(self._process.stdout.readline())

    def _send(self, line: str) -> None:
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()


def measure(versions: list[Version], batch: Batch) -> list[float]:
    """Return the seconds of each version for a batch."""
    seconds = [0.0 for _ in versions]
    for version in versions:
        version.begin(batch)
    for generation in range(batch.generations):
        # The first version of a turn alternates.
        for index in (0, 1) if generation % 2 else (1, 0):
            seconds[index] += versions[index].measure_generation()
    if len({version.finish() for version in versions}) > 1:
        print(f"{batch.condition}, runs {batch.runs}: the results of the versions differ")
    return seconds


def describe_ratios(ratios: list[float]) -> str:
    """Return the mean of at least two ratios, and its 95 % interval."""
    mean = fmean(ratios)
    quantile = student_t.ppf(0.975, len(ratios) - 1)
    half_width = quantile * stdev(ratios) / math.sqrt(len(ratios))
    return f"{mean:.3f} ({mean - half_width:.3f} to {mean + half_width:.3f})"


def print_row(name: str, pairs: list[list[float]]) -> None:
    """Print the mean seconds of each version, and the ratio, of pairs (old, new)."""
    old, new = (fmean(values) for values in zip(*pairs, strict=True))
    print(f"| {name} | {old:.2f} | {new:.2f} | {describe_ratios([b / a for a, b in pairs])} |")


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare the speed of the study in two versions.")
    parser.add_argument("folder", type=Path, help="checkout of the older version")
    parser.add_argument("--batches", type=int, default=8, help="batches of four runs: 8 for all 30")
    parser.add_argument("--generations", type=int, default=100)
    options = parser.parse_args()
    pairs: dict[str, list[list[float]]] = {condition: [] for condition in CONDITIONS}
    with ExitStack() as running:
        versions = [Version(folder.resolve(), running) for folder in (options.folder, NEW_FOLDER)]
        for condition in CONDITIONS:
            # Compile.
            measure(versions, Batch(condition, [0, 1, 2, 3], 2))
        for number in range(options.batches):
            runs = [number * RUNS_PER_BATCH + run for run in range(RUNS_PER_BATCH)]
            for condition in CONDITIONS:
                batch = Batch(condition, runs, options.generations)
                pairs[condition].append(measure(versions, batch))
    print("| condition | old, s | new, s | ratio (95 % interval) |\n|---|---|---|---|")
    for condition in CONDITIONS:
        print_row(condition, pairs[condition])
    batches = zip(*pairs.values(), strict=True)
    print_row("all", [[sum(seconds) for seconds in zip(*batch, strict=True)] for batch in batches])


if __name__ == "__main__":
    main()
