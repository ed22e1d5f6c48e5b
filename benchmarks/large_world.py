"""Measure a run of one world in a process: `python -m benchmarks.large_world AGENTS THREADS`.

The run has founders, two short lifetimes and one reproduction. All agents are self-taught newborns
among the food of map A, which is enlarged with the number of agents.
It prints one line of JSON, see `Measurement`.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from baldwinlab.engine.threads import use_threads
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.backends.team import MIN_AGENTS
from baldwinlab.simulation.simulate import simulate_histories
from benchmarks.scaling import at_constant_density

GENERATIONS = 2
STEPS = 100
# Agent-steps of a measurement of lifetimes in a small world.
MIN_AGENT_STEPS = 200_000
KIB_PER_GIB = 1024**2


class Measurement(NamedTuple):
    """Nanoseconds per agent-step, and memory.

    Attributes
    ----------
    agents, threads : int
        Size of the world, and number of threads.
    run_ns : float
        Elapsed time of a complete run, with founders and births.
    run_cpu_ns : float
        CPU time of all threads in a complete run.
    steps_ns : float
        Elapsed time of the steps alone.
    steps_cpu_ns : float
        CPU time of all threads in the steps.
    peak_gib : float
        Peak memory of the process.
    """

    agents: int
    threads: int
    run_ns: float
    run_cpu_ns: float
    steps_ns: float
    steps_cpu_ns: float
    peak_gib: float


def measure(agents: int, threads: int) -> Measurement:
    """Return the measurement of a world in this process, after compilation."""
    experiment = at_constant_density(agents).replace(
        evolution={"generations": GENERATIONS}, lifetime={"steps": STEPS}
    )
    # A smaller world uses the same code.
    compile_size = min(agents, MIN_AGENTS)
    _simulate_run(experiment.replace(population={"size": compile_size}, lifetime={"steps": 1}))
    with use_threads(threads):
        n_runs = max(1, MIN_AGENT_STEPS // (agents * GENERATIONS * STEPS))
        run_ns, run_cpu_ns = _time(
            lambda: [_simulate_run(experiment) for _ in range(n_runs)],
            n_runs * agents * GENERATIONS * STEPS,
        )
        batch = CpuBatch(experiment, seed=0, runs=[0])
        genomes = draw_genomes(experiment, GenerationKey(0, 0, 0))
        batch.begin(0, np.stack([genomes]))
        steps = max(STEPS, MIN_AGENT_STEPS // agents)
        steps_ns, steps_cpu_ns = _time(lambda: batch.simulate(0, steps), steps * agents)
    peak_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return Measurement(
        agents, threads, run_ns, run_cpu_ns, steps_ns, steps_cpu_ns, peak_kib / KIB_PER_GIB
    )


def _simulate_run(experiment: Experiment) -> None:
    simulate_histories(experiment, seed=0, runs=[0])


def _time(function: Callable[[], object], agent_steps: int) -> tuple[float, float]:
    """Return the elapsed time and the CPU time of a call, in nanoseconds per agent-step."""
    start = time.perf_counter(), time.process_time()
    function()
    seconds = time.perf_counter() - start[0], time.process_time() - start[1]
    return seconds[0] * 1e9 / agent_steps, seconds[1] * 1e9 / agent_steps


if __name__ == "__main__":
    print(json.dumps(measure(*map(int, sys.argv[1:]))._asdict()))
