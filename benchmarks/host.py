"""Time between two lifetimes: `python -m benchmarks.host`.

A generation of one step in a batch of 64 runs has almost no lifetime, so the time of the run is the
time of selection, variation, inheritance and records. It is CPU time per run and generation. Code
that Numba compiled runs without the lock of the interpreter, so several threads can run it at the
same time. The rest of the time is under the lock.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import baldwinlab as bl
from baldwinlab.engine.numba_internals import dispatchers
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate_histories

CONDITION = "evo+self-taught/A"
N_RUNS = 64
N_GENERATIONS = 50
N_ROUNDS = 5
SETTINGS = {"lifetime": {"steps": 1}, "evolution": {"generations": N_GENERATIONS}}


class CompiledTime:
    """Sum of the times in compiled functions, which this process looks up from now on."""

    def __init__(self) -> None:
        self.seconds = 0.0
        find = dispatchers.find_compiled_function
        dispatchers.find_compiled_function = lambda *arguments: self._measure(find(*arguments))

    def _measure(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            start = time.thread_time()
            result = function(*arguments)
            self.seconds += time.thread_time() - start
            return result

        return call


def measure_simulation(compiled_time: CompiledTime) -> tuple[float, float]:
    """Return seconds of CPU time, and of them in compiled code, of one batch without storage."""
    experiment = load(CONDITION).replace(**SETTINGS)
    compiled_before = compiled_time.seconds
    start = time.process_time()
    simulate_histories(experiment, seed=1, runs=range(N_RUNS))
    return time.process_time() - start, compiled_time.seconds - compiled_before


def measure_study() -> float:
    """Return seconds of CPU time of a study of the same runs, with storage."""
    experiment = load(CONDITION).replace(**SETTINGS)
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        bl.run([experiment], runs=N_RUNS, seed=1, workers=1, out=Path(folder) / "study")
        return time.process_time() - start


def main() -> None:
    compiled_time = CompiledTime()
    measure_simulation(compiled_time)
    rounds = [measure_simulation(compiled_time) for _ in range(N_ROUNDS)]
    total = median(seconds for seconds, _ in rounds)
    compiled = median(seconds for _, seconds in rounds)
    measure_study()
    study = median(measure_study() for _ in range(N_ROUNDS))
    scale = 1e6 / (N_RUNS * N_GENERATIONS)
    print(f"{CONDITION}, {N_RUNS} runs, {N_GENERATIONS} generations of one step")
    print(f"{'CPU time per run and generation':40}{total * scale:8.1f} us")
    print(f"{'of it under the lock':40}{(total - compiled) * scale:8.1f} us")
    print(f"{'as a study, with storage':40}{study * scale:8.1f} us")


if __name__ == "__main__":
    main()
