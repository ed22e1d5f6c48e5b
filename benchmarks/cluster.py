"""What a cluster would make of a study: `python -m benchmarks.cluster`, about three minutes. Needs the extra `cluster`.

Measures on this machine what a run costs, how two worker processes compare with one and with threads, and what a task and an
event cost a Dask scheduler that runs in a process of its own; then works out a study of a million runs on 10,000 cores. What a
process did is taken as its CPU time, which others who use the machine hardly change.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path
from statistics import mean, median
from typing import NamedTuple
from unittest.mock import patch

import psutil
from distributed import Client, get_worker

from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.papers.presets import load, paper
from baldwinlab.simulation.compilation import warm_up
from baldwinlab.simulation.simulate import simulate_batch
from baldwinlab.studies.executors import THREADS, Executor, choose, dask
from baldwinlab.studies.records import encode
from baldwinlab.studies.run import MOST_TASKS, Evolve, missing_runs, plan
from baldwinlab.studies.store import create
from benchmarks.machine import provenance
from benchmarks.tables import table

RUNS, CORES = 1_000_000, 10_000  # of the study that is planned
ROUNDS = 4
TASKS = 5000  # that do nothing, to load the scheduler
EVENTS = 20_000


class Process:
    """A process that was started, with the children it has."""

    def __init__(self, *words: str) -> None:
        self._popen = subprocess.Popen(
            [sys.executable, "-m", "dask", *words], stderr=subprocess.DEVNULL
        )
        self._process = psutil.Process(self._popen.pid)

    def cpu(self) -> float:
        """Seconds of CPU time."""
        times = [
            each.cpu_times() for each in (self._process, *self._process.children(recursive=True))
        ]
        return sum(time.user + time.system for time in times)

    def mib(self) -> float:
        return float(self._process.memory_info().rss) / 2**20

    def end(self) -> None:
        self._popen.terminate()
        self._popen.wait()


@contextmanager
def scheduler() -> Iterator[tuple[Process, str]]:
    """A Dask scheduler in a process of its own, on loopback, and its address."""
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
    """So many worker processes of one thread each."""
    words = ("--host", "127.0.0.1", "--nthreads", "1", "--no-dashboard", "--no-nanny")
    started = [Process("worker", address, *words) for _ in range(count)]
    try:
        with Client(address, set_as_default=False) as client:
            client.wait_for_workers(count)
        yield started
    finally:
        for process in started:
            process.end()


class Run(NamedTuple):
    """A run of the paper on one thread, on average over the six conditions."""

    live: float  # CPU seconds
    store: float  # CPU seconds
    check: float  # CPU seconds to read it back when a study is carried on
    size: float  # bytes of its file
    small: float  # bytes of its file if genomes are kept of the first and the last generation only


def of_a_run() -> Run:
    warm_up(paper())
    found = []
    with tempfile.TemporaryDirectory() as folder:
        study = create(Path(folder), paper(), seed=0)
        for experiment in paper():
            times = [time.thread_time()]
            (record, *_) = simulate_batch(experiment, 0, range(CPU.worlds))
            times.append(time.thread_time())
            study.write(experiment.name, 0, record)
            times.append(time.thread_time())
            study.record(experiment.name, 0)
            live, store, check = (
                after - before for before, after in pairwise([*times, time.thread_time()])
            )
            fewer = record.assign(
                genome=record.genome.where(record.generation.isin([0, record.generation[-1]]))
            )
            found.append(
                Run(live / CPU.worlds, store, check, len(encode(record)), len(encode(fewer)))
            )
    return Run(*map(mean, zip(*found, strict=True)))


class Took(NamedTuple):
    wall: float  # seconds
    cpu: float  # CPU seconds of all processes that took part


def small_study(executor: Executor, workers: int, processes: Sequence[Process]) -> Took:
    """24 runs of 60 generations, which is what is done everywhere."""
    experiment = load("evo+self-taught/A").replace(evolution={"generations": 60})
    with tempfile.TemporaryDirectory() as folder:
        study = create(Path(folder), [experiment], seed=0)
        tasks = plan(study, missing_runs(study, 24, print), 2)
        cpu, began = (
            sum(process.cpu() for process in processes) + time.process_time(),
            time.perf_counter(),
        )
        with closing(executor.do(study, tasks, workers, CPU)) as amounts:
            assert sum(amounts) == sum(task.agent_steps for task in tasks)
        wall = time.perf_counter() - began
        return Took(wall, sum(process.cpu() for process in processes) + time.process_time() - cpu)


def of_two_workers() -> dict[str, list[Took]]:
    """That study on one worker process, on two, on one thread and on two, in interleaved rounds."""
    with (
        scheduler() as (first, one),
        scheduler() as (second, two),
        workers(one, 1) as single,
        workers(two, 2) as pair,
    ):
        places = {
            "1 thread": (THREADS, 1, []),
            "2 threads": (THREADS, 2, []),
            "1 worker process": (choose(f"dask:{one}"), 1, [first, *single]),
            "2 worker processes": (choose(f"dask:{two}"), 2, [second, *pair]),
        }
        for place in places.values():
            small_study(*place)
        rounds = [
            {name: small_study(*place) for name, place in places.items()} for _ in range(ROUNDS)
        ]
    return {name: [found[name] for found in rounds] for name in places}


class Costs(NamedTuple):
    """Of a Dask scheduler and its tasks; times are CPU seconds."""

    begin: float  # a worker process, until its engine is loaded
    order: float  # bytes of a task as it is sent
    send: float  # a task, in the process that sends it
    schedule: float  # a task, in the scheduler
    wait: float  # bytes of a task that waits in the scheduler
    event: float  # an event, in the scheduler
    rate: float  # tasks a second that do nothing, with everything on this machine


def nothing(order: bytes) -> None:
    """In place of a task's work."""


def send_events(count: int) -> None:
    for _ in range(count):
        get_worker().log_event(
            "benchmark", ("baldwinlab-0123456789abcdef0123456789abcdef-12345", 123_456_789)
        )


def settle(process: Process) -> None:
    """Wait until a process has nothing left to do."""
    before = -1.0
    while process.cpu() - before > 0.05:
        before = process.cpu()
        time.sleep(1)


def of_the_scheduler() -> Costs:
    with (
        tempfile.TemporaryDirectory() as folder,
        scheduler() as (process, address),
        Client(address) as client,
    ):
        study = create(Path(folder), paper(), seed=0)
        tasks = [Evolve(experiment, tuple(range(50))) for experiment in paper()] * (TASKS // 6)
        orders = dask._orders(study, tasks, CPU, "benchmark")
        with workers(address, 2) as started:
            client.run(warm_up, paper())
            begin = mean(worker.cpu() for worker in started)
            settle(process)
            before, own, began = process.cpu(), time.process_time(), time.perf_counter()
            with (
                patch.object(dask, "_work", nothing),
                closing(choose(f"dask:{address}").do(study, tasks, 2, CPU)) as amounts,
            ):
                assert sum(amounts) == sum(task.agent_steps for task in tasks)
            took, send = time.perf_counter() - began, time.process_time() - own
            settle(process)
            scheduled = process.cpu()
            client.submit(send_events, EVENTS, pure=False).result()
            settle(process)
            event = (process.cpu() - scheduled) / EVENTS
        empty = process.mib()
        waiting = client.map(nothing, orders, pure=False, batch_size=dask.BATCH)
        settle(process)
        wait = (process.mib() - empty) * 2**20 / len(waiting)
    count = len(tasks)
    order = mean(map(len, orders))
    return Costs(
        begin, order, send / count, (scheduled - before) / count, wait, event, count / took
    )


def measured(run: Run, costs: Costs) -> str:
    rows = [
        ["to live a run of the paper", f"{run.live:.2f} CPU s"],
        ["to store it", f"{1e3 * run.store:.1f} CPU ms, {run.size / 1e6:.2f} MB in a file"],
        [
            "the file, if genomes are kept of the first and last generation only",
            f"{run.small / 1e6:.2f} MB",
        ],
        ["to check it when a study is carried on", f"{1e3 * run.check:.1f} CPU ms"],
        ["to begin a worker process, with the engine compiled before", f"{costs.begin:.1f} CPU s"],
        ["a task, as it is sent", f"{costs.order / 1e3:.1f} kB"],
        ["a task, in the command that sends it", f"{1e3 * costs.send:.2f} CPU ms"],
        [
            "a task, in the scheduler",
            f"{1e3 * costs.schedule:.2f} CPU ms, {costs.wait / 1e3:.1f} kB while it waits",
        ],
        ["an event, in the scheduler", f"{1e6 * costs.event:.0f} CPU us"],
        ["tasks that do nothing, with everything on this machine", f"{costs.rate:.0f} a second"],
    ]
    return table(["what", "measured"], rows)


def compared(places: dict[str, list[Took]]) -> str:
    """Efficiency is against one thread: its time over the time here times the workers, round by round."""
    rows = []
    for name, rounds in places.items():
        count = int(name[0])
        wall, cpu = ([getattr(took, field) for took in rounds] for field in Took._fields)
        alone = places["1 thread"]
        ratios = [one.wall / (count * here) for one, here in zip(alone, wall, strict=True)]
        work = [one.cpu / here for one, here in zip(alone, cpu, strict=True)]
        rows.append([name, spread(wall), spread(ratios), spread(cpu), spread(work)])
    return table(["24 runs on", "s", "efficiency", "CPU s", "efficiency by CPU time"], rows)


def spread(values: Sequence[float]) -> str:
    return f"{median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def planned(run: Run, costs: Costs) -> str:
    """The study of a million runs on 10,000 cores."""
    batches = -(-RUNS // (CPU.worlds * MOST_TASKS))
    runs, cost = CPU.worlds * batches, run.live + run.store
    tasks, wall, least = -(-RUNS // runs), RUNS * cost / CORES, RUNS // CPU.worlds
    cores, files, rate = RUNS * cost / 3600, RUNS / wall, RUNS * run.size / wall / 1e9
    split, events = (
        f"{batches} batches of {CPU.worlds}",
        100 * dask.EVENTS_A_SECOND * costs.event,
    )
    rows = [
        [
            "work",
            f"{RUNS:,} runs x {cost:.2f} s = {cores:,.0f} core hours, {wall:.0f} s of 10,000 cores",
        ],
        [
            "tasks",
            f"{tasks:,} of {runs} runs ({split}), {runs * cost:.0f} s each, {tasks / CORES:.1f} a core",
        ],
        [
            "sent by the command",
            f"{tasks * costs.order / 1e6:.0f} MB, {tasks * costs.send:.0f} CPU s",
        ],
        ["scheduler", f"{tasks * costs.schedule:.0f} CPU s, {tasks * costs.wait / 1e6:.0f} MB"],
        [
            "its load",
            f"{tasks / wall:,.0f} tasks a second, where {1 / costs.schedule:,.0f} would keep it busy",
        ],
        [
            "its load by events",
            f"{dask.EVENTS_A_SECOND} a second at most, {events:.2f} % of its time",
        ],
        [
            "had every batch been a task",
            f"{least:,} tasks, {least / wall:,.0f} a second, {least * costs.schedule:.0f} CPU s",
        ],
        [
            "written",
            f"{RUNS:,} files, {RUNS * run.size / 1e12:.2f} TB: {files:,.0f} files and {rate:.0f} GB a second",
        ],
        [
            "written, with few genomes",
            f"{RUNS * run.small / 1e12:.2f} TB, {RUNS * run.small / wall / 1e9:.0f} GB a second",
        ],
        ["to check it all when it is carried on", f"{RUNS * run.check / 60:.0f} minutes"],
    ]
    return table(["a million runs on 10,000 cores", "worked out"], rows)


def main() -> None:
    machine = provenance()
    print(
        f"{machine['cpu']}, {machine['cores']} cores, load {machine['load']}; Python {machine['python']},",
        end=" ",
    )
    print(f"distributed {version('distributed')}.\n")
    run, costs, places = of_a_run(), of_the_scheduler(), of_two_workers()
    print(measured(run, costs), compared(places), planned(run, costs), sep="\n\n")


if __name__ == "__main__":
    main()
