"""Extrapolate a study to a cluster: `python -m benchmarks.cluster`, about three minutes.

The command needs the extra `cluster`. It measures the cost of a run, of one and two worker
processes and threads, of a task and an event in a separate Dask scheduler, and the overhead of tiny
runs. From these it computes the cost of a million runs on 10,000 cores. The work of a process is
its CPU time, which other processes hardly change.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from contextlib import closing
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path
from statistics import mean, median
from typing import NamedTuple
from unittest.mock import patch

from distributed import Client, get_worker

from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.papers.presets import load, paper
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.simulate import simulate_batch
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors import THREADS, Executor, choose_executor, dask
from baldwinlab.studies.records import encode_record
from baldwinlab.studies.run import (
    MAX_TASKS,
    MIN_TASKS_PER_WORKER,
    RunTask,
    find_missing_runs,
    plan_tasks,
)
from benchmarks.cluster_overhead import measure_overhead, overhead_table
from benchmarks.dask_processes import Process, scheduler, workers
from benchmarks.machine import provenance
from benchmarks.tables import table

# The extrapolated study.
N_RUNS = 1_000_000
N_CORES = 10_000
N_ROUNDS = 4
# Empty tasks, and events, for the load of the scheduler.
N_TASKS = 5000
N_EVENTS = 20_000


class Run(NamedTuple):
    """The cost of a run of the paper on one thread, averaged over the six conditions.

    Attributes
    ----------
    simulate, store, check : float
        CPU seconds to simulate the run, to store it, and to check it at resume.
    size, small : float
        Bytes of the file, with genomes of all generations, and of the first and last one only.
    """

    simulate: float
    store: float
    check: float
    size: float
    small: float


def measure_run() -> Run:
    """Measure the cost of a run."""
    compile_experiments(paper())
    costs = []
    with tempfile.TemporaryDirectory() as folder:
        study = create_study(Path(folder), paper(), seed=0)
        for experiment in paper():
            times = [time.thread_time()]
            (record, *_) = simulate_batch(experiment, 0, range(CPU.worlds))
            times.append(time.thread_time())
            study.write(experiment.name, 0, record)
            times.append(time.thread_time())
            study.record(experiment.name, 0)
            times.append(time.thread_time())
            simulate, store, check = (after - before for before, after in pairwise(times))
            is_stored = record.generation.isin([0, record.generation[-1]])
            small = record.assign(genome=record.genome.where(is_stored))
            sizes = (len(encode_record(record)), len(encode_record(small)))
            costs.append(Run(simulate / CPU.worlds, store, check, *sizes))
    return Run(*map(mean, zip(*costs, strict=True)))


class Duration(NamedTuple):
    """Seconds, and CPU seconds of all processes."""

    wall: float
    cpu: float


def small_study(executor: Executor, workers: int, processes: Sequence[Process]) -> Duration:
    """Simulate 24 runs of 60 generations, and return the duration."""
    experiment = load("evo+self-taught/A").replace(evolution={"generations": 60})
    with tempfile.TemporaryDirectory() as folder:
        study = create_study(Path(folder), [experiment], seed=0)
        tasks = plan_tasks(study, find_missing_runs(study, 24, print), 2)
        cpu = sum(process.cpu() for process in processes) + time.process_time()
        began = time.perf_counter()
        with closing(executor.run(study, tasks, workers, CPU)) as amounts:
            assert sum(amounts) == sum(task.agent_steps for task in tasks)
        wall = time.perf_counter() - began
        total = sum(process.cpu() for process in processes) + time.process_time()
        return Duration(wall, total - cpu)


def measure_workers() -> dict[str, list[Duration]]:
    """Measure the study on one and two worker processes and threads, in interleaved rounds."""
    with (
        scheduler() as (first, first_address),
        scheduler() as (second, second_address),
        workers(first_address, 1) as single,
        workers(second_address, 2) as pair,
    ):
        executors = {
            "1 thread": (THREADS, 1, []),
            "2 threads": (THREADS, 2, []),
            "1 worker process": (choose_executor(f"dask:{first_address}"), 1, [first, *single]),
            "2 worker processes": (choose_executor(f"dask:{second_address}"), 2, [second, *pair]),
        }
        for executor in executors.values():
            small_study(*executor)
        rounds = [
            {name: small_study(*executor) for name, executor in executors.items()}
            for _ in range(N_ROUNDS)
        ]
    return {name: [durations[name] for durations in rounds] for name in executors}


class Costs(NamedTuple):
    """The costs of a Dask scheduler and its tasks; times are CPU seconds.

    Attributes
    ----------
    begin : float
        A worker process, until its engine is loaded.
    order, wait : float
        Bytes of a task as it is sent, and as it waits in the scheduler.
    send, schedule : float
        A task, in the process that sends it, and in the scheduler.
    event : float
        An event, in the scheduler.
    rate : float
        Empty tasks per second, with all processes on this machine.
    """

    begin: float
    order: float
    send: float
    schedule: float
    wait: float
    event: float
    rate: float


def do_nothing(order: bytes) -> None:
    """Replace the work of a task."""


def send_events(count: int) -> None:
    """Send events from a worker."""
    for _ in range(count):
        get_worker().log_event(
            "benchmark", ("baldwinlab-0123456789abcdef0123456789abcdef-12345", 123_456_789)
        )


def wait_until_idle(process: Process) -> None:
    """Wait until a process uses no CPU time."""
    before = -1.0
    while process.cpu() - before > 0.05:
        before = process.cpu()
        time.sleep(1)


def measure_scheduler() -> Costs:
    """Measure the costs of a scheduler."""
    with (
        tempfile.TemporaryDirectory() as folder,
        scheduler() as (process, address),
        Client(address) as client,
    ):
        study = create_study(Path(folder), paper(), seed=0)
        tasks = [RunTask(experiment, tuple(range(50))) for experiment in paper()] * (N_TASKS // 6)
        submission = dask.Submission(client, study, CPU, tasks)
        orders = [submission.pack_task(task, 2) for task in tasks]
        with workers(address, 2) as started:
            client.run(compile_experiments, paper())
            begin = mean(worker.cpu() for worker in started)
            wait_until_idle(process)
            before = process.cpu()
            cpu_began = time.process_time()
            began = time.perf_counter()
            with (
                patch.object(dask, "run_remote_task", do_nothing),
                closing(choose_executor(f"dask:{address}").run(study, tasks, 2, CPU)) as amounts,
            ):
                assert sum(amounts) == sum(task.agent_steps for task in tasks)
            seconds = time.perf_counter() - began
            send = time.process_time() - cpu_began
            wait_until_idle(process)
            scheduled = process.cpu()
            client.submit(send_events, N_EVENTS, pure=False).result()
            wait_until_idle(process)
            event = (process.cpu() - scheduled) / N_EVENTS
        empty = process.mib()
        waiting = client.map(do_nothing, orders, pure=False, batch_size=dask.TASKS_PER_WAVE)
        wait_until_idle(process)
        wait = (process.mib() - empty) * 2**20 / len(waiting)
    count = len(tasks)
    order = mean(map(len, orders))
    return Costs(
        begin=begin,
        order=order,
        send=send / count,
        schedule=(scheduled - before) / count,
        wait=wait,
        event=event,
        rate=count / seconds,
    )


def measurement_table(run: Run, costs: Costs) -> str:
    """Return a table of the measured costs."""
    rows = [
        ["simulate a run of the paper", f"{run.simulate:.2f} CPU s"],
        ["store it", f"{1e3 * run.store:.1f} CPU ms, {run.size / 1e6:.2f} MB in a file"],
        [
            "its file with genomes of the first and last generation only",
            f"{run.small / 1e6:.2f} MB",
        ],
        ["check it at resume", f"{1e3 * run.check:.1f} CPU ms"],
        ["start a worker process with a compiled engine", f"{costs.begin:.1f} CPU s"],
        ["send a task", f"{costs.order / 1e3:.1f} kB"],
        ["a task, in the command", f"{1e3 * costs.send:.2f} CPU ms"],
        [
            "a task, in the scheduler",
            f"{1e3 * costs.schedule:.2f} CPU ms, {costs.wait / 1e3:.1f} kB while it waits",
        ],
        ["an event, in the scheduler", f"{1e6 * costs.event:.0f} CPU us"],
        ["empty tasks, with all processes on this machine", f"{costs.rate:.0f} per second"],
    ]
    return table(["operation", "cost"], rows)


def worker_table(executors: dict[str, list[Duration]]) -> str:
    """Return a table of the efficiency relative to one thread, by round."""
    rows = []
    for name, durations in executors.items():
        count = int(name[0])
        pairs = list(zip(executors["1 thread"], durations, strict=True))
        ratios = [thread.wall / (count * duration.wall) for thread, duration in pairs]
        cpu_ratios = [thread.cpu / duration.cpu for thread, duration in pairs]
        wall = [duration.wall for duration in durations]
        cpu = [duration.cpu for duration in durations]
        rows.append([name, spread(wall), spread(ratios), spread(cpu), spread(cpu_ratios)])
    return table(["24 runs on", "s", "efficiency", "CPU s", "efficiency by CPU time"], rows)


def spread(values: Sequence[float]) -> str:
    """Return median and range as text."""
    return f"{median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def extrapolation_table(run: Run, costs: Costs) -> str:
    """Return a table of the costs of a million runs on 10,000 cores."""
    max_tasks = max(MAX_TASKS, MIN_TASKS_PER_WORKER * N_CORES)
    batches = -(-N_RUNS // (CPU.worlds * max_tasks))
    runs = CPU.worlds * batches
    cost = run.simulate + run.store
    tasks = -(-N_RUNS // runs)
    wave = min(tasks, dask.TASKS_PER_CORE * N_CORES)
    wall = N_RUNS * cost / N_CORES
    n_batches = N_RUNS // CPU.worlds
    core_hours = N_RUNS * cost / 3600
    files = N_RUNS / wall
    rate = N_RUNS * run.size / wall / 1e9
    split = f"{batches} batches of {CPU.worlds}"
    events = 100 * dask.EVENTS_PER_SECOND * costs.event
    rows = [
        [
            "work",
            f"{N_RUNS:,} runs x {cost:.2f} s = {core_hours:,.0f} core hours, "
            f"{wall:.0f} s of 10,000 cores",
        ],
        [
            "tasks",
            f"{tasks:,} of {runs} runs ({split}), {runs * cost:.0f} s each, "
            f"{tasks / N_CORES:.1f} per core",
        ],
        [
            "sent by the command",
            f"{tasks * costs.order / 1e6:.0f} MB, {tasks * costs.send:.0f} CPU s",
        ],
        [
            "scheduler",
            f"{tasks * costs.schedule:.0f} CPU s, {wave * costs.wait / 1e6:.0f} MB for {wave:,} "
            "waiting tasks",
        ],
        [
            "its load",
            f"{tasks / wall:,.0f} of at most {1 / costs.schedule:,.0f} tasks per second",
        ],
        [
            "its load by events",
            f"{dask.EVENTS_PER_SECOND} per second at most, {events:.2f} % of its time",
        ],
        [
            "with one batch per task",
            f"{n_batches:,} tasks, {n_batches / wall:,.0f} per second, "
            f"{n_batches * costs.schedule:.0f} CPU s",
        ],
        [
            "written",
            f"{N_RUNS:,} files, {N_RUNS * run.size / 1e12:.2f} TB: "
            f"{files:,.0f} files and {rate:.0f} GB per second",
        ],
        [
            "written, with few genomes",
            f"{N_RUNS * run.small / 1e12:.2f} TB, "
            f"{N_RUNS * run.small / wall / 1e9:.0f} GB per second",
        ],
        ["check all runs at resume", f"{N_RUNS * run.check / 60:.0f} minutes"],
    ]
    return table(["a million runs on 10,000 cores", "extrapolated"], rows)


def main() -> None:
    machine = provenance()
    print(
        f"{machine['cpu']}, {machine['cores']} cores, load {machine['load']}; "
        f"Python {machine['python']}, distributed {version('distributed')}.\n"
    )
    run = measure_run()
    costs = measure_scheduler()
    tables = [
        measurement_table(run, costs),
        worker_table(measure_workers()),
        overhead_table(measure_overhead()),
        extrapolation_table(run, costs),
    ]
    print(*tables, sep="\n\n")


if __name__ == "__main__":
    main()
