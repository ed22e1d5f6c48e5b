"""Compare the results of an NVIDIA GPU with the results of the CPU.

    python -m scripts.check_gpu [--speeds]

The script simulates every kind of experiment on both, each kind in a process of its own. Then it
runs the study of the paper on both, side by side, and compares all record files byte by byte. It
exits with status 1 if a bit differs. With `--speeds`, it also prints agent-steps per second of
complete generations, without compilation, for several numbers of worlds.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba import cuda as numba_cuda

from baldwinlab import papers, run
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import named_arrays
from baldwinlab.models.miniworld.backends import cpu, cuda
from baldwinlab.models.miniworld.backends.choice import Batch
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file

PARTS_FOLDER = Path(__file__).parents[1] / "examples" / "parts"
WORLDS = 40
SPEED_WORLDS = (30, 180, 2640, 21120)
AT_THE_FOOD = {"start": {"x": 480, "y": 160, "radius": 70}}
FOOD = {"x": [400, 560], "y": [80, 240]}


def make_experiments() -> Iterator[tuple[str, Experiment]]:
    """Yield experiments for every path through the engine, with newborns at the food."""
    for condition in ("evo/A", "evo+self-taught/A", "evo+self-taught/B"):
        yield condition, load(condition)
        yield (
            f"{condition}, at the food",
            load(condition).replace(world=AT_THE_FOOD),
        )
    base = load("evo+self-taught/A").replace(world=AT_THE_FOOD)
    yield "sequential", base.replace(lifetime={"update": "sequential", "steps": 500})
    yield "biases, two hidden layers", base.replace(network={"biases": True, "hidden": [10, 5]})
    yield "100 agents", base.replace(population={"size": 100})
    yield (
        "items in cells",
        base.replace(world={"food": [{**FOOD, "count": 1000}]}, population={"size": 100}),
    )
    yield "no food", base.replace(world={"food": []})
    yield "square contact", base.replace(contact={"shape": "square"})
    for name in ("social", "poison", "obstacles", "elman"):
        load_file(PARTS_FOLDER / f"{name}.py")
    walls = {"features": ["poison", "obstacles"], "obstacles": {"x": [470, 490], "y": [100, 220]}}
    yield "social", base.replace(learning={"rule": "social"})
    yield "poison and walls", base.replace(world=walls, senses={"kinds": ["food", "poison"]})
    yield "memory", base.replace(network={"kind": "elman"})
    yield (
        "items across the edge",
        base.replace(world={"food": [{"x": [0, 640], "y": [0, 640], "count": 700}]}),
    )


def draw_genomes(experiment: Experiment, worlds: int) -> np.ndarray:
    shape = (worlds, experiment.population.size, len(experiment.modules), experiment.genome_length)
    return np.random.default_rng(1).standard_normal(shape, np.float32)


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
    experiment = dict(make_experiments())[title].replace(**changes)
    # A driver can raise any exception, and the remaining kinds are compared anyway.
    try:
        arrays = list_differences(experiment, worlds)
    except Exception as error:
        return f"fails with {type(error).__name__}: {error}"
    return f"differs in {', '.join(arrays)}" if arrays else ""


def compare_kinds(
    titles: Sequence[str], worlds: int = WORLDS, changes: Mapping[str, Any] | None = None
) -> bool:
    """Compare kinds of experiments side by side. Print the results, and return whether all agree.

    `changes` are changes of all experiments.
    """
    count = len(titles)
    # A process that has used a GPU cannot be forked.
    pool = ProcessPoolExecutor(min(count, os.cpu_count() or 1), mp_context=get_context("spawn"))
    with pool:
        remarks = pool.map(compare_kind, titles, [worlds] * count, [changes or {}] * count)
        failed = 0
        for title, remark in zip(titles, remarks, strict=True):
            failed += bool(remark)
            print(f"{title}: {remark or 'bit-identical'}", flush=True)
    if failed:
        print(f"{failed} of {count} kinds of experiments differ between GPU and CPU.")
    return not failed


def list_different_files(folder: Path, other_folder: Path) -> tuple[list[str], int]:
    """Return the record files that differ or are missing in one folder, and the number of files."""
    names = sorted(
        {
            path.relative_to(root).as_posix()
            for root in (folder, other_folder)
            for path in find(root)
        }
    )
    return [name for name in names if read(folder / name) != read(other_folder / name)], len(names)


def find(folder: Path) -> Iterable[Path]:
    return (folder / "runs").rglob("*.nc")


def read(path: Path) -> bytes | None:
    return path.read_bytes() if path.exists() else None


def run_study(folder: Path, backend: str, options: Mapping[str, Any]) -> None:
    run(papers.load().experiments(), out=folder, backend=backend, **options)


def compare_studies(
    folder: Path, backends: Sequence[str] = ("cpu", "cuda"), **options: Any
) -> bool:
    """Run the paper's study on two backends side by side, and compare the record files.

    Print the results, and return whether they agree. `options` are arguments of `baldwinlab.run`.
    """
    folders = [folder / f"{number}-{backend}" for number, backend in enumerate(backends)]
    # The CPU simulates while the kernels of the GPU are compiled.
    with ProcessPoolExecutor(len(backends), mp_context=get_context("spawn")) as pool:
        list(pool.map(run_study, folders, backends, [options] * len(backends)))
    different, count = list_different_files(*folders)
    if different:
        names = ", ".join(different[:3]) + (" and others" if len(different) > 3 else "")
        print(
            f"{len(different)} of {count} record files differ between {' and '.join(backends)}: "
            f"{names}. Both studies are in {folder}."
        )
    else:
        print(f"{count} of {count} record files are byte-identical.")
    return bool(count) and not different


def measure_speed(experiment: Experiment, worlds: int) -> float:
    """Return agent-steps per second of complete generations, the best of three."""
    batch = cuda.CudaBatch(experiment, 7, range(worlds))
    population = draw_genomes(experiment, worlds)
    seconds = []
    # The first generation may compile, so it is not counted.
    for generation in range(4):
        start_time = time.perf_counter()
        batch.begin(generation, population)
        batch.simulate(0, experiment.lifetime.steps)
        batch.eaten_in_life()
        seconds.append(time.perf_counter() - start_time)
    return worlds * experiment.population.size * experiment.lifetime.steps / min(seconds[1:])


def print_speeds() -> None:
    for condition in ("evo/A", "evo+self-taught/A"):
        for title, world in (("start of the paper", {}), ("start at the food", AT_THE_FOOD)):
            experiment = load(condition).replace(world=world)
            for worlds in SPEED_WORLDS:
                rate = f"{measure_speed(experiment, worlds):.3g} agent-steps/s"
                print(f"{condition}, {title}: {worlds} worlds: {rate}", flush=True)


def main(arguments: Sequence[str]) -> int:
    if problem := cuda.unavailable_reason():
        print(problem)
        return 1
    device = numba_cuda.get_current_device().name
    name = device.decode() if isinstance(device, bytes) else device
    print(f"{name}; {os.cpu_count()} cores; numba {numba.__version__}, numpy {np.__version__}")
    folder = Path(tempfile.mkdtemp(prefix="check-gpu-"))
    agrees = [
        compare_kinds([title for title, _ in make_experiments()]),
        compare_studies(folder, runs=30),
    ]
    if agrees[1]:
        shutil.rmtree(folder)
    if "--speeds" in arguments:
        print_speeds()
    return int(not all(agrees))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
