"""Time between two lifetimes: `python -m benchmarks.host [--out DIR]`.

A generation of one step in a batch of 64 runs has almost no lifetime, so the time of the run is the
time of selection, variation, inheritance and records. It is CPU time per run and generation.
`benchmarks.lock` defines which part of it is under the lock of the interpreter. The command writes
host.md.
"""

from __future__ import annotations

import argparse
import io
import tempfile
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from statistics import median

import baldwinlab as bl
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate_histories
from benchmarks.compare import OUTPUT_FOLDER
from benchmarks.lock import Clock
from benchmarks.machine import provenance
from benchmarks.tables import describe_machine, table

CONDITION = "evo+self-taught/A"
N_RUNS = 64
N_GENERATIONS = 50
N_ROUNDS = 5
EXPERIMENT = load(CONDITION).replace(
    lifetime={"steps": 1}, evolution={"generations": N_GENERATIONS}
)


def simulate_batch() -> None:
    """Simulate one batch without storage."""
    simulate_histories(EXPERIMENT, seed=1, runs=range(N_RUNS))


def run_study() -> None:
    """Simulate and store a study of the same runs, without its messages."""
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
        bl.run([EXPERIMENT], runs=N_RUNS, seed=1, workers=1, out=Path(folder) / "study")


def measure(clock: Clock, function: Callable[[], None]) -> tuple[float, float]:
    """Return the CPU time, and of it the time under the lock, in us per run and generation."""
    # The first call loads or compiles the code.
    function()
    rounds = []
    for _ in range(N_ROUNDS):
        start = clock.read()
        function()
        rounds.append(clock.read() - start)
    scale = 1e6 / (N_RUNS * N_GENERATIONS)
    return (
        scale * median(times.cpu for times in rounds),
        scale * median(times.under_lock for times in rounds),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--out", type=Path, default=OUTPUT_FOLDER)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    machine = describe_machine(provenance())
    clock = Clock()
    works = {"simulation": simulate_batch, "study, with storage": run_study}
    rows = [
        [name, *(f"{value:.1f}" for value in measure(clock, function))]
        for name, function in works.items()
    ]
    title = f"{CONDITION}, {N_RUNS} runs, {N_GENERATIONS} generations of one step"
    header = [title, "CPU time per run and generation, us", "of it under the lock, us"]
    text = f"{machine}.\n\n{table(header, rows)}\n"
    (given.out / "host.md").write_text(text, "utf-8")
    print(text)


if __name__ == "__main__":
    main()
