"""Check an NVIDIA GPU: the bits of its results against the CPU, and its speed against JAX.

    python -m scripts.check_gpu

The script needs `make cuda`, and takes at most two minutes on a machine with 16 cores. It has four
steps, each with a time limit:

1. Simulate every kind of experiment on the GPU and on the CPU, each kind in a process of its own.
2. Measure the speed for several numbers of worlds.
3. Run the study of the paper on both, side by side, and compare all record files byte by byte.
4. Measure JAX on the same GPU, if a JAX with support of the GPU is installed.

The script exits with status 1 if a bit differs or a step does not end.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final, NamedTuple

import numba
import numpy as np
from numba import cuda as numba_cuda

from baldwinlab import papers, run
from baldwinlab.engine.gpu import SIMULATED
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import named_arrays
from baldwinlab.models.miniworld.backends import cpu, cuda
from baldwinlab.models.miniworld.backends.choice import Batch
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file
from benchmarks.gpu import AT_THE_FOOD, draw_genomes, measure_conditions, measure_jax

PARTS_FOLDER = Path(__file__).parents[1] / "examples" / "parts"
FOOD: dict[str, Any] = {"x": [400, 560], "y": [80, 240]}


class Sizes(NamedTuple):
    """The sizes and the time limits of the steps."""

    worlds: int = 40  # Number of worlds of each kind of experiment.
    speed_worlds: Sequence[int] = (180, 2_640, 21_120)
    jax_worlds: int = 2_640
    runs: int = 30  # Number of runs of each condition of the study.
    changes: Mapping[str, Any] = {}  # Changes of all experiments, such as {"lifetime": ...}.
    kinds: Sequence[str] = ()  # Titles of the kinds of experiments; all if empty.
    # Seconds of each step.
    limits: Sequence[float] = (50, 20, 30, 20)


FULL: Final = Sizes()


def make_experiments() -> dict[str, Experiment]:
    """Return experiments for every path through the engine, by title, with newborns at the food."""
    for name in ("social", "poison", "obstacles", "elman"):
        load_file(PARTS_FOLDER / f"{name}.py")
    experiments = {}
    for condition in ("evo/A", "evo+self-taught/A", "evo+self-taught/B"):
        experiments[condition] = load(condition)
        experiments[f"{condition}, at the food"] = load(condition).replace(world=AT_THE_FOOD)
    walls = {"features": ["poison", "obstacles"], "obstacles": {"x": [470, 490], "y": [100, 220]}}
    everywhere = {"x": [0, 640], "y": [0, 640], "count": 700}
    crowd = {"size": 100}
    changes: dict[str, dict[str, Any]] = {
        "sequential": {"lifetime": {"update": "sequential", "steps": 500}},
        "biases, two hidden layers": {"network": {"biases": True, "hidden": [10, 5]}},
        "100 agents": {"population": crowd},
        "items in cells": {"world": {"food": [FOOD | {"count": 1000}]}, "population": crowd},
        "no food": {"world": {"food": []}},
        "square contact": {"contact": {"shape": "square"}},
        "social": {"learning": {"rule": "social"}},
        "poison and walls": {"world": walls, "senses": {"kinds": ["food", "poison"]}},
        "memory": {"network": {"kind": "elman"}},
        "items across the edge": {"world": {"food": [everywhere]}},
    }
    base = load("evo+self-taught/A").replace(world=AT_THE_FOOD)
    return experiments | {title: base.replace(**change) for title, change in changes.items()}


def list_differences(experiment: Experiment, worlds: int) -> list[str]:
    """Return the names of arrays that differ between GPU and CPU, without scratch."""
    batches: list[Batch] = [
        cpu.CpuBatch(experiment, 7, range(worlds)),
        cuda.CudaBatch(experiment, 7, range(worlds)),
    ]
    for batch in batches:
        batch.begin(3, draw_genomes(experiment, worlds))
        batch.simulate(0, experiment.lifetime.steps)
    on_cpu, on_gpu = (
        named_arrays(batch.state, worlds, experiment.population.size) for batch in batches
    )
    return [name for name in on_cpu if on_cpu[name].tobytes() != on_gpu[name].tobytes()]


def compare_kind(title: str, worlds: int, changes: Mapping[str, Any]) -> str:
    """Return how the results of a kind of experiment differ, or an empty text."""
    experiment = make_experiments()[title].replace(**changes)
    # A driver can raise any exception, and the remaining kinds are compared anyway.
    try:
        arrays = list_differences(experiment, worlds)
    except Exception as error:
        return f"fails with {type(error).__name__}: {error}"
    return f"differs in {', '.join(arrays)}" if arrays else ""


def call_side_by_side(
    function: Callable[..., Any], arguments: Sequence[tuple[Any, ...]], seconds: float
) -> list[Any]:
    """Call a function in a process for each tuple of arguments. Return the results in this order.

    A process that is not finished after `seconds` is killed, and its result is a TimeoutError.
    The result of a process that fails is an EOFError.
    """
    # A process that has used a GPU cannot be forked.
    context = get_context("spawn")
    end = time.monotonic() + seconds
    calls = []
    for values in arguments:
        receiver, sender = context.Pipe(duplex=False)
        process = context.Process(target=_send_result, args=(sender, function, values))
        process.start()
        # The receiver then reaches the end of the pipe when the process ends.
        sender.close()
        calls.append((process, receiver))
    results: list[Any] = []
    for process, receiver in calls:
        try:
            is_finished = receiver.poll(max(0, end - time.monotonic()))
            results.append(receiver.recv() if is_finished else TimeoutError())
        except EOFError as error:
            results.append(error)
        process.kill()
        process.join()
    return results


def _send_result(
    sender: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]
) -> None:
    sender.send(function(*arguments))


def describe_failure(result: Any, seconds: float) -> str:
    """Return why a call has no result, or an empty text if it has one."""
    if isinstance(result, TimeoutError):
        return f"not finished after {seconds} s"
    return "failed" if isinstance(result, EOFError) else ""


def compare_kinds(sizes: Sizes, seconds: float) -> bool:
    """Compare kinds of experiments side by side. Print results, and return whether all agree."""
    titles = sizes.kinds or list(make_experiments())
    arguments = [(title, sizes.worlds, sizes.changes) for title in titles]
    results = call_side_by_side(compare_kind, arguments, seconds)
    n_failed = 0
    for title, result in zip(titles, results, strict=True):
        remark = describe_failure(result, seconds) or result
        n_failed += bool(remark)
        print(f"{title}: {remark or 'bit-identical'}", flush=True)
    if n_failed:
        print(f"{n_failed} of {len(titles)} kinds of experiments differ or failed.")
    return not n_failed


def measure_speed(sizes: Sizes, seconds: float) -> bool:
    """Measure and print the speed of the GPU. Return whether the measurement has ended."""
    return _measure(measure_conditions, (sizes.speed_worlds, sizes.changes), seconds)


def measure_speed_of_jax(sizes: Sizes, seconds: float) -> bool:
    """Measure and print the speed of JAX. Return whether the measurement has ended."""
    return _measure(measure_jax, (sizes.jax_worlds, sizes.changes), seconds)


def _measure(function: Callable[..., None], arguments: tuple[Any, ...], seconds: float) -> bool:
    """Call a function that prints its measurements. Return whether it has ended."""
    (result,) = call_side_by_side(function, [arguments], seconds)
    failure = describe_failure(result, seconds)
    if failure:
        print(f"{function.__name__}: {failure}")
    return not failure


def list_different_files(folder: Path, other_folder: Path) -> tuple[list[str], int]:
    """Return the record files that differ or are missing in one folder, and the number of files."""
    contents = [
        {path.relative_to(root): path.read_bytes() for path in (root / "runs").rglob("*.nc")}
        for root in (folder, other_folder)
    ]
    first, second = contents
    names = sorted({*first, *second})
    different = [name.as_posix() for name in names if first.get(name) != second.get(name)]
    return different, len(names)


def run_study(folder: Path, backend: str, runs: int, changes: Mapping[str, Any]) -> float:
    """Run the study of the paper. Return the seconds that it took, with compilation."""
    experiments = [experiment.replace(**changes) for experiment in papers.load().experiments()]
    start = time.perf_counter()
    run(experiments, out=folder, backend=backend, runs=runs)
    return time.perf_counter() - start


def compare_studies(
    sizes: Sizes, seconds: float, backends: Sequence[str] = ("cpu", "cuda")
) -> bool:
    """Run the paper's study on two backends side by side, and compare the record files.

    Print the results, and return whether they agree. The studies remain if they differ.
    """
    folder = Path(tempfile.mkdtemp(prefix="check-gpu-"))
    folders = [folder / f"{number}-{backend}" for number, backend in enumerate(backends)]
    arguments = [
        (path, backend, sizes.runs, sizes.changes)
        for path, backend in zip(folders, backends, strict=True)
    ]
    results = call_side_by_side(run_study, arguments, seconds)
    for backend, result in zip(backends, results, strict=True):
        time_text = describe_failure(result, seconds) or f"{result:.1f} s"
        print(f"the study of the paper on {backend}: {time_text}")
    different, count = list_different_files(*folders)
    if different or not count:
        names = ", ".join(different[:3]) + (" and others" if len(different) > 3 else "")
        print(
            f"{len(different)} of {count} record files differ between {' and '.join(backends)}: "
            f"{names}. Both studies are in {folder}."
        )
        return False
    print(f"{count} of {count} record files are byte-identical.")
    shutil.rmtree(folder)
    return True


STEPS = (compare_kinds, measure_speed, compare_studies, measure_speed_of_jax)


def main(sizes: Sizes = FULL) -> int:
    if problem := cuda.unavailable_reason():
        print(problem)
        return 1
    # Without numba-cuda, the simulator of Numba has no devices.
    name = "the simulator of a GPU" if SIMULATED else numba_cuda.get_current_device().name
    name = name.decode() if isinstance(name, bytes) else name
    print(f"{name}; {os.cpu_count()} cores; numba {numba.__version__}, numpy {np.__version__}")
    has_succeeded = []
    for step, seconds in zip(STEPS, sizes.limits, strict=True):
        start = time.perf_counter()
        has_succeeded.append(step(sizes, seconds))
        print(f"{step.__name__}: {time.perf_counter() - start:.1f} s", flush=True)
    return int(not all(has_succeeded))


if __name__ == "__main__":
    sys.exit(main())
