"""Cost of a study against its size: `python -m benchmarks.scale [--out DIR] [--limit N]`.

The command runs the same studies with this version and with an earlier commit, in turns: many tiny
runs, many agents in a world, and several threads, for the runs of a study or for one large world.
The cost includes the storage, but not the compilation and the start. It is CPU time, which other
processes on the machine change little. For threads it is elapsed time. It writes scale.json and
scale.md.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from benchmarks.compare import OUTPUT_FOLDER
from benchmarks.machine import provenance
from benchmarks.race import ROOT
from benchmarks.tables import table

EARLIER_COMMIT = "999bf75"
N_ROUNDS = 3
# Agent-steps of a study with up to 10,000 agents, and with more. Fewer take less time than the
# start varies.
N_AGENT_STEPS = 400_000_000
N_AGENT_STEPS_OF_LARGE_WORLDS = 40_000_000
MAX_SMALL_WORLD = 10_000
# The earlier version stores one file per run, which takes too long for more runs.
MAX_EARLIER_RUNS = 10_000
NOT_MEASURED = "not measured"
THREADS = "threads"
THREADS_OF_A_WORLD = "threads of one world"
N_THREADS = (1, 2)


class Seconds(NamedTuple):
    """Duration of a command."""

    elapsed: float
    cpu: float


@dataclass(frozen=True)
class Case:
    """A study to measure, as the arguments of `baldwinlab run`."""

    quantity: str
    size: int
    steps: int
    agents: int = 20
    runs: int = 1
    generations: int = 2
    workers: int = 1

    @property
    def arguments(self) -> list[str]:
        settings = (
            f"evolution.generations={self.generations}",
            f"lifetime.steps={self.steps}",
            f"population.size={self.agents}",
        )
        flags = [word for setting in settings for word in ("--set", setting)]
        numbers = ["--runs", str(self.runs), "--workers", str(self.workers)]
        return ["run", "evo/A", *flags, *numbers, "--force"]

    @property
    def agent_steps(self) -> int:
        return self.runs * self.generations * self.steps * self.agents


SMALLEST_STUDY = Case("start", 1, steps=1, agents=4)


def list_cases(limit: int) -> list[Case]:
    """Return the cases with at most `limit` runs and agents."""
    cases = [
        Case("runs", n_runs, steps=20, agents=4, runs=n_runs)
        for n_runs in (100, 10_000, 100_000)
        if n_runs <= limit
    ]
    for n_agents in (20, 1_000, 10_000, 100_000, 1_000_000):
        is_small = n_agents <= MAX_SMALL_WORLD
        agent_steps = N_AGENT_STEPS if is_small else N_AGENT_STEPS_OF_LARGE_WORLDS
        if n_agents <= limit:
            cases.append(
                Case("agents", n_agents, steps=agent_steps // (2 * n_agents), agents=n_agents)
            )
    cases += [Case(THREADS, count, steps=5000, runs=320, workers=count) for count in N_THREADS]
    # A run uses the threads that have no other run.
    n_agents = min(limit, 100_000)
    steps = N_AGENT_STEPS_OF_LARGE_WORLDS // (2 * n_agents)
    return cases + [
        Case(THREADS_OF_A_WORLD, count, steps, n_agents, workers=count) for count in N_THREADS
    ]


@contextmanager
def earlier_version() -> Iterator[Path]:
    """Check the earlier commit out into a temporary folder, which is removed at the end."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "earlier"
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", folder, EARLIER_COMMIT], check=True)
        try:
            yield folder
        finally:
            subprocess.run([*git, "remove", "--force", folder], check=True)


def measure(case: Case, folder: Path) -> float | None:
    """Return nanoseconds per agent-step of the version in `folder`, None if it refuses the case.

    The time of the smallest study is subtracted: that of imports and of loading the engine.
    """
    start, total = _run(SMALLEST_STUDY, folder), _run(case, folder)
    if start is None or total is None:
        return None
    is_elapsed = case.quantity in (THREADS, THREADS_OF_A_WORLD)
    seconds = total.elapsed - start.elapsed if is_elapsed else total.cpu - start.cpu
    return seconds * 1e9 / case.agent_steps


def _run(case: Case, folder: Path) -> Seconds | None:
    with tempfile.TemporaryDirectory() as name:
        start = time.perf_counter()
        cpu_start = _cpu_of_children()
        # Python imports the package of the current folder.
        finished = subprocess.run(
            [sys.executable, "-m", "baldwinlab", *case.arguments, "--out", f"{name}/study"],
            cwd=folder,
            env=os.environ | {"BALDWINLAB_CACHE": str(folder / "build" / "scale-cache")},
            capture_output=True,
            check=False,
        )
        if finished.returncode:
            return None
        return Seconds(time.perf_counter() - start, _cpu_of_children() - cpu_start)


def _cpu_of_children() -> float:
    """Return the CPU time of the ended processes that this process started, in seconds."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def measure_cases(cases: list[Case]) -> list[dict[str, Any]]:
    """Return the costs of each case in both versions, measured in turns."""
    rows = []
    with earlier_version() as earlier:
        for case in cases:
            is_slow = case.quantity == "runs" and case.size > MAX_EARLIER_RUNS
            versions = {"now": ROOT} | ({} if is_slow else {"earlier": earlier})
            costs: dict[str, list[float]] = {"now": [], "earlier": []}
            for folder in versions.values():
                # The first run compiles.
                _run(case, folder)
            for _ in range(N_ROUNDS):
                for version, folder in versions.items():
                    cost = measure(case, folder)
                    costs[version] += [] if cost is None else [cost]
            print(case.quantity, case.size, costs, flush=True)
            rows.append({"quantity": case.quantity, "size": case.size, **costs})
    return rows


def format_rows(rows: list[dict[str, Any]]) -> str:
    """Return a table: nanoseconds per agent-step, and the speed relative to the earlier commit."""
    cells = []
    for row in rows:
        now, earlier = ([*map(float, row[version])] for version in ("now", "earlier"))
        ratio = f"{median(earlier) / median(now):.2f}" if now and earlier else NOT_MEASURED
        medians = [f"{median(costs):.4g}" if costs else NOT_MEASURED for costs in (now, earlier)]
        cells.append([row["quantity"], f"{row['size']:,}", *medians, ratio])
    header = ["varied", "size", "ns per agent-step", f"at {EARLIER_COMMIT}", "speed ratio"]
    return table(header, cells) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--out", type=Path, default=OUTPUT_FOLDER)
    parser.add_argument("--limit", type=int, default=1_000_000, help="most runs and agents")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    rows = measure_cases(list_cases(given.limit))
    text = format_rows(rows)
    results = {"machine": provenance(), "rows": rows}
    (given.out / "scale.json").write_text(json.dumps(results, indent=1) + "\n", "utf-8")
    (given.out / "scale.md").write_text(text, "utf-8")
    print(text)


if __name__ == "__main__":
    main()
