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
from collections.abc import Iterator
from contextlib import closing, contextmanager
from importlib.metadata import version
from pathlib import Path
from statistics import median
from unittest.mock import patch

import psutil
from distributed import Client, get_worker

from baldwinlab.engine.backend import CPU
from baldwinlab.executors import THREADS, Executor, Task, choose, cluster
from baldwinlab.presets import load, paper
from baldwinlab.simulate import simulate_block
from baldwinlab.store import create, encode, write_record
from baldwinlab.study import MOST_TASKS, missing_runs, plan
from benchmarks.machine import facts
from benchmarks.tables import table

RUNS, CORES = 1_000_000, 10_000  # of the study that is planned
ROUNDS = 5
TASKS = 5000  # that do nothing, to load the scheduler
EVENTS = 20_000


class Process:
    """A process that was started, with the children it has."""

    def __init__(self, *words: str) -> None:
        self._popen = subprocess.Popen([sys.executable, "-m", "dask", *words], stderr=subprocess.DEVNULL)
        self._process = psutil.Process(self._popen.pid)

    def cpu(self) -> float:
        """Seconds of CPU time."""
        times = [each.cpu_times() for each in (self._process, *self._process.children(recursive=True))]
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
        words = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file))
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


def of_a_run() -> dict[str, float]:
    """A run of the paper, on average over the six conditions, on one thread: CPU seconds to live, CPU seconds to store, bytes."""
    lived = stored = size = 0.0
    CPU.warm_up(paper())
    with tempfile.TemporaryDirectory() as folder:
        for experiment in paper():
            began = time.thread_time()
            (record, *_) = simulate_block(experiment, 0, range(CPU.worlds))
            lived += (time.thread_time() - began) / CPU.worlds
            began = time.thread_time()
            write_record(Path(folder), experiment.name, 0, record)
            stored += time.thread_time() - began
            size += len(encode(record))
    return {"CPU s to live": lived / 6, "CPU s to store": stored / 6, "bytes": size / 6}


def seconds(executor: Executor, workers: int) -> float:
    """Seconds for the same small study: 24 runs of 25 generations."""
    experiment = load("evo+self-taught/A").replace(evolution={"generations": 25})
    with tempfile.TemporaryDirectory() as folder:
        study = create(Path(folder), [experiment], seed=0)
        tasks = plan(study, missing_runs(study, 24, print), 2)
        began = time.perf_counter()
        with closing(executor.do(study, tasks, workers, CPU)) as amounts:
            assert sum(amounts) == sum(task.agent_steps for task in tasks)
        return time.perf_counter() - began


def of_two_workers() -> dict[str, list[float]]:
    """Seconds of that study on one worker process, on two, on one thread and on two, in interleaved rounds."""
    with scheduler() as (_, one), scheduler() as (_, two), workers(one, 1), workers(two, 2):
        places = {
            "1 worker process": (choose(f"dask:{one}"), 1),
            "2 worker processes": (choose(f"dask:{two}"), 2),
            "1 thread": (THREADS, 1),
            "2 threads": (THREADS, 2),
        }
        for executor, count in places.values():
            seconds(executor, count)
        rounds = [{name: seconds(*place) for name, place in places.items()} for _ in range(ROUNDS)]
    return {name: [found[name] for found in rounds] for name in places}


def nothing(order: str) -> None:
    """In place of a task's work."""


def send_events(count: int) -> None:
    for _ in range(count):
        get_worker().log_event("benchmark", ("baldwinlab-0123456789abcdef0123456789abcdef-12345", 123_456_789))


def settle(process: Process) -> None:
    """Wait until a process has nothing left to do."""
    before = -1.0
    while process.cpu() - before > 0.05:
        before = process.cpu()
        time.sleep(1)


def of_the_scheduler() -> dict[str, float]:
    """What a task, an event and a waiting task cost a scheduler, and what it costs a worker to begin."""
    with tempfile.TemporaryDirectory() as folder, scheduler() as (process, address), Client(address) as client:
        study = create(Path(folder), paper(), seed=0)
        tasks = [Task(experiment, tuple(range(50))) for experiment in paper()] * (TASKS // 6)
        with workers(address, 2) as started:
            settle(started[0])
            begin = started[0].cpu()
            settle(process)
            before, own, began = process.cpu(), time.process_time(), time.perf_counter()
            with patch.object(cluster, "_work", nothing):
                assert sum(choose(f"dask:{address}").do(study, tasks, 2, CPU)) == sum(task.agent_steps for task in tasks)
            took = time.perf_counter() - began
            found = {
                "tasks a second on this machine": len(tasks) / took,
                "CPU s of the client": (time.process_time() - own) / len(tasks),
            }
            settle(process)
            found["CPU s of the scheduler"] = (process.cpu() - before) / len(tasks)
            before = process.cpu()
            client.submit(send_events, EVENTS, pure=False).result()
            settle(process)
            found["CPU s of the scheduler for an event"] = (process.cpu() - before) / EVENTS
        orders = cluster._orders(study, tasks, CPU, "benchmark")
        before = process.mib()
        waiting = client.map(nothing, orders, pure=False, batch_size=cluster.BATCH)
        settle(process)
        found["bytes in the scheduler"] = (process.mib() - before) * 2**20 / len(waiting)
    return found | {"bytes of an order": sum(map(len, orders)) / len(orders), "CPU s to begin a worker": begin}


def measured(run: dict[str, float], two: dict[str, list[float]], task: dict[str, float]) -> str:
    rows = [
        ["to live a run of the paper", f"{run['CPU s to live']:.2f} CPU s"],
        ["to store it", f"{1000 * run['CPU s to store']:.0f} CPU ms, {run['bytes'] / 1e6:.2f} MB in a file"],
        ["to begin a worker process, until it waits for tasks", f"{task['CPU s to begin a worker']:.1f} CPU s"],
        ["a task's order, as it is sent", f"{task['bytes of an order'] / 1e3:.1f} kB"],
        [
            "a task in the scheduler",
            f"{1e3 * task['CPU s of the scheduler']:.2f} CPU ms, {task['bytes in the scheduler'] / 1e3:.0f} kB while it waits",
        ],
        ["a task in the command that sends it", f"{1e3 * task['CPU s of the client']:.2f} CPU ms"],
        ["an event in the scheduler", f"{1e6 * task['CPU s of the scheduler for an event']:.0f} CPU us"],
        [
            "tasks that do nothing, scheduler, command and workers on this machine",
            f"{task['tasks a second on this machine']:.0f} a second",
        ],
    ]
    places = [[name, f"{median(taken):.2f}", f"{min(taken):.2f} to {max(taken):.2f}"] for name, taken in two.items()]
    return "\n\n".join(
        [table(["what", "measured"], rows), table(["the same 24 runs on", "s, median", "least to most"], places), efficiency(two)]
    )


def efficiency(two: dict[str, list[float]]) -> str:
    """Of two workers: how near they come to half the time, round by round."""
    sentences = []
    for many, one in (("2 worker processes", "1 worker process"), ("2 threads", "1 thread"), ("2 worker processes", "2 threads")):
        share = 1.0 if one[0] == many[0] else 0.5
        ratios = [share * there / here for there, here in zip(two[one], two[many], strict=True)]
        sentences.append(f"{many} against {one}: {median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})")
    return "Efficiency, median (and range) of the rounds: " + "; ".join(sentences) + "."


def planned(run: dict[str, float], task: dict[str, float]) -> str:
    """The study of a million runs on 10,000 cores."""
    blocks = -(-RUNS // (CPU.worlds * MOST_TASKS))
    runs, cost = CPU.worlds * blocks, run["CPU s to live"] + run["CPU s to store"]
    tasks, wall = -(-RUNS // runs), RUNS * cost / CORES
    rows = [
        ["work", f"{RUNS:,} runs x {cost:.2f} s = {RUNS * cost / 3600:,.0f} core hours: {wall:.0f} s of 10,000 cores"],
        [
            "tasks",
            f"{tasks:,} of {runs} runs ({blocks} blocks of {CPU.worlds}): {runs * cost:.0f} s each, {tasks / CORES:.1f} a core",
        ],
        [
            "written",
            f"{RUNS:,} files of {run['bytes'] / 1e6:.2f} MB = {RUNS * run['bytes'] / 1e12:.2f} TB: {RUNS / wall:,.0f} files and {RUNS * run['bytes'] / wall / 1e9:.1f} GB a second",
        ],
        [
            "sent by the command",
            f"{tasks * task['bytes of an order'] / 1e6:.0f} MB of orders, {tasks * task['CPU s of the client']:.0f} CPU s",
        ],
        [
            "scheduler's time",
            f"{tasks * task['CPU s of the scheduler']:.0f} CPU s for the tasks, {tasks / wall:.0f} tasks a second, of {1 / task['CPU s of the scheduler']:.0f} that it can do",
        ],
        ["scheduler's memory", f"{tasks * task['bytes in the scheduler'] / 1e6:.0f} MB for the tasks"],
        [
            "events",
            f"at most {cluster.EVENTS_A_SECOND} a second: {100 * cluster.EVENTS_A_SECOND * task['CPU s of the scheduler for an event']:.1f} % of the scheduler's time",
        ],
        [
            "had every block been a task",
            f"{RUNS // CPU.worlds:,} tasks of {CPU.worlds * cost:.1f} s: {RUNS / CPU.worlds / wall:,.0f} tasks a second, {RUNS / CPU.worlds * task['CPU s of the scheduler']:.0f} CPU s of the scheduler",
        ],
        ["to begin 10,000 workers", f"{task['CPU s to begin a worker']:.1f} CPU s each, at the same time"],
    ]
    return table(["1,000,000 runs of the paper on 10,000 cores", "from what was measured"], rows)


def main() -> None:
    machine = facts()
    print(
        f"{machine['cpu']}, {machine['cores']} cores; Python {machine['python']}, distributed {version('distributed')}; load {machine['load']}\n"
    )
    run, task, two = of_a_run(), of_the_scheduler(), of_two_workers()
    print(measured(run, two, task), planned(run, task), sep="\n\n")


if __name__ == "__main__":
    main()
