"""Overhead of tiny runs on a cluster: `python -m benchmarks.cluster_overhead`, about a minute.

The overhead is the time of a study in addition to the simulation: tasks, messages and storage. A
run has 2 generations of 4 agents with 20 steps. CPU times of all processes change little if other
programs run.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.papers.presets import load
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors import Executor, choose_executor
from baldwinlab.studies.run import find_missing_runs, plan_tasks
from benchmarks.dask_processes import Process, scheduler, workers
from benchmarks.tables import table

EXPERIMENT = load("evo/A").replace(
    evolution={"generations": 2}, lifetime={"steps": 20}, population={"size": 4}
)
N_RUNS = 4000
# Runs of the measurement without a study.
N_SIMULATED = 1000
MILLISECONDS = 1000


class Overhead(NamedTuple):
    """Times per run, in milliseconds.

    Attributes
    ----------
    n_workers : int
        Number of worker processes.
    simulation, simulation_cpu : float
        Wall and CPU time of the simulation alone.
    wall : float
        Wall time of a worker: that of the study, times the number of workers.
    cpu : float
        CPU time of the scheduler, the workers and the command.
    """

    n_workers: int
    simulation: float
    simulation_cpu: float
    wall: float
    cpu: float

    @property
    def overhead(self) -> float:
        """Wall time of a worker without the simulation."""
        return self.wall - self.simulation

    @property
    def cpu_overhead(self) -> float:
        """CPU time of all processes without the simulation."""
        return self.cpu - self.simulation_cpu


def measure_overhead(n_workers: Sequence[int] = (1, 2), n_runs: int = N_RUNS) -> list[Overhead]:
    """Measure the overhead of tiny runs on clusters with these numbers of worker processes."""
    compile_experiments([EXPERIMENT])
    return [_measure_cluster(count, n_runs) for count in n_workers]


def _measure_cluster(n_workers: int, n_runs: int) -> Overhead:
    with scheduler() as (process, address), workers(address, n_workers) as started:
        executor = choose_executor(f"dask:{address}")
        processes = [process, *started]
        # The workers load the engine.
        _measure_study(executor, processes, n_workers * CPU.worlds)
        _simulate()
        simulation, simulation_cpu = _simulate()
        wall, cpu = _measure_study(executor, processes, n_runs)
    return Overhead(n_workers, simulation, simulation_cpu, n_workers * wall, cpu)


def _simulate() -> tuple[float, float]:
    """Return the wall and CPU time of a run without a study, in batches of the same size."""
    wall, cpu = time.perf_counter(), time.process_time()
    for first in range(0, N_SIMULATED, CPU.worlds):
        simulate_histories(EXPERIMENT, 0, range(first, first + CPU.worlds))
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    return wall / N_SIMULATED * MILLISECONDS, cpu / N_SIMULATED * MILLISECONDS


def _measure_study(
    executor: Executor, processes: Sequence[Process], n_runs: int
) -> tuple[float, float]:
    """Return the wall and CPU time of a run of a study."""
    with tempfile.TemporaryDirectory() as folder:
        study = create_study(Path(folder), [EXPERIMENT], seed=0)
        cpu = sum(process.cpu() for process in processes) + time.process_time()
        wall = time.perf_counter()
        tasks = plan_tasks(study, find_missing_runs(study, n_runs, print), executor.workers)
        with closing(executor.run(study, tasks, executor.workers, CPU)) as increments:
            assert sum(increments) == sum(task.agent_steps for task in tasks)
        wall = time.perf_counter() - wall
        cpu = sum(process.cpu() for process in processes) + time.process_time() - cpu
        return wall / n_runs * MILLISECONDS, cpu / n_runs * MILLISECONDS


def overhead_table(measurements: Sequence[Overhead]) -> str:
    """Return a table of the times per run in milliseconds."""
    rows = [
        [
            str(entry.n_workers),
            *(
                f"{value:.2f}"
                for value in (
                    entry.simulation,
                    entry.wall,
                    entry.overhead,
                    entry.simulation_cpu,
                    entry.cpu,
                    entry.cpu_overhead,
                )
            ),
        ]
        for entry in measurements
    ]
    header = ["workers", "simulation", "study", "overhead", "simulation", "study", "overhead"]
    caption = "Wall time of a worker, then CPU time of all processes, in ms per tiny run."
    return f"{caption}\n\n{table(header, rows)}"


def main() -> None:
    print(overhead_table(measure_overhead()))


if __name__ == "__main__":
    main()
