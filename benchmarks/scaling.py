"""Speed-up by the number of workers: `python -m benchmarks.scaling [--out DIR]`.

The command runs the paper's study, and 10,000 runs of two short generations, with 1, 2, 4, 8 and 16
workers, as far as this machine has cores. From the run with one worker, it computes the serial
share: the CPU time under the lock of the interpreter, divided by the total CPU time. Amdahl's law
then predicts the speed-up on more cores.

A study for more workers has more and smaller tasks, which need more time under the lock. So one
thread also executes the tasks of 16 workers, and their serial share gives a second prediction.

Two parts are measured: the complete command, with the start of Python and the comparison of the
conditions, and in it the simulation with the storage of the records. It writes scaling.md.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from baldwinlab import papers
from baldwinlab.engine.threads import available_cores
from benchmarks.compare import OUTPUT_FOLDER
from benchmarks.lock import Times
from benchmarks.machine import provenance
from benchmarks.race import ROOT
from benchmarks.tables import describe_machine, table

# Measured if the machine has as many cores, and otherwise only predicted.
N_WORKERS = (1, 2, 4, 8, 16)
# Only predicted.
N_WORKERS_OF_LARGE_MACHINE = 64
# One thread executes the tasks of a study for this number of workers.
N_WORKERS_OF_TASKS = 16
PARTS = {"command": "complete command", "session": "simulation and storage"}


class Work(NamedTuple):
    """Arguments of `baldwinlab run`, and the number of runs of each condition."""

    name: str
    arguments: list[str]
    runs: int


def list_works() -> list[Work]:
    paper = papers.load()
    conditions = [experiment.name for experiment in paper.experiments()]
    runs = paper.metadata.runs
    tiny = ["population.size=4", "lifetime.steps=20", "evolution.generations=2"]
    return [
        Work(f"The paper's {len(conditions)} conditions, {runs} runs each", conditions, runs),
        Work("10,000 runs: 2 generations, 20 steps, 4 agents", ["evo/A", "--set", *tiny], 10_000),
    ]


def measure(work: Work, workers: int, threads: int) -> dict[str, Times]:
    """Run a command in a new process. Return the times of each of `PARTS`.

    `threads`: number of threads that execute the tasks of `workers` workers.
    """
    with tempfile.TemporaryDirectory() as name:
        times_file = Path(name) / "times.json"
        numbers = ["--runs", str(work.runs), "--workers", str(workers)]
        command = ["run", *work.arguments, *numbers, "--out", f"{name}/study", "--force"]
        start = time.perf_counter()
        subprocess.run(
            [sys.executable, "-m", "benchmarks.lock", str(times_file), str(threads), *command],
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
            check=True,
        )
        elapsed = time.perf_counter() - start
        times = json.loads(times_file.read_text("utf-8"))
    # The elapsed time of the command includes the start and the end of the process.
    times["command"]["elapsed"] = elapsed
    return {part: Times(**values) for part, values in times.items()}


def predict_speedup(single: Times, measured: Times, workers: int) -> float:
    """Return the speed-up, compared with `single`, of the work of `measured` by Amdahl's law."""
    return single.cpu / (measured.under_lock + measured.released / workers)


def format_work(work: Work, measured: dict[int, dict[str, Times]], tasks: dict[str, Times]) -> str:
    """Return the serial shares and the speed-ups of a work as text and a table.

    `measured`: times by number of workers. `tasks`: times of the tasks of `N_WORKERS_OF_TASKS`
    workers on one thread.
    """
    columns = [*N_WORKERS, N_WORKERS_OF_LARGE_MACHINE]
    sentences, rows = [], []
    for part, name in PARTS.items():
        single = measured[1][part]
        for count, times in ((1, single), (N_WORKERS_OF_TASKS, tasks[part])):
            sentences.append(
                f"Serial share of the {name} with --workers {count}: {times.serial_share:.1%}, "
                f"{times.under_lock:.2f} of {times.cpu:.2f} s of CPU time on one thread."
            )
        seconds = {workers: times[part].elapsed for workers, times in measured.items()}
        speedups = {workers: single.elapsed / elapsed for workers, elapsed in seconds.items()}
        lines = {"elapsed s": seconds, "speed-up": speedups}
        for label, times in (
            ("predicted speed-up", single),
            (f"predicted, tasks of --workers {N_WORKERS_OF_TASKS}", tasks[part]),
        ):
            lines[label] = {count: predict_speedup(single, times, count) for count in columns}
        for label, values in lines.items():
            cells = [f"{values[count]:.2f}" if count in values else "" for count in columns]
            rows.append([f"{name}: {label}", *cells])
    header = ["workers", *map(str, columns)]
    return "\n\n".join([f"**{work.name}**", "\n".join(sentences), table(header, rows)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--out", type=Path, default=OUTPUT_FOLDER)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    texts = [f"{describe_machine(provenance())}."]
    for work in list_works():
        # The first command compiles.
        measure(work._replace(runs=1), 1, 1)
        counts = [count for count in N_WORKERS if count <= available_cores()]
        measured = {count: measure(work, count, count) for count in counts}
        tasks = measure(work, N_WORKERS_OF_TASKS, 1)
        texts.append(format_work(work, measured, tasks))
    text = "\n\n".join(texts) + "\n"
    (given.out / "scaling.md").write_text(text, "utf-8")
    print(text)


if __name__ == "__main__":
    main()
