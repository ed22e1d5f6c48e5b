"""Compare the results of an NVIDIA GPU with the results of the CPU.

    python -m scripts.check_gpu

The script simulates every kind of experiment on both, each kind in a process of its own. Then it
runs the study of the paper on both, side by side, and compares all record files byte by byte. It
exits with status 1 if a bit differs.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
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
AT_THE_FOOD = {"start": {"x": 480, "y": 160, "radius": 70}}
FOOD: dict[str, Any] = {"x": [400, 560], "y": [80, 240]}


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
    experiment = make_experiments()[title].replace(**changes)
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
    contents = [
        {path.relative_to(root): path.read_bytes() for path in (root / "runs").rglob("*.nc")}
        for root in (folder, other_folder)
    ]
    first, second = contents
    names = sorted({*first, *second})
    different = [name.as_posix() for name in names if first.get(name) != second.get(name)]
    return different, len(names)


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


def main() -> int:
    if problem := cuda.unavailable_reason():
        print(problem)
        return 1
    device = numba_cuda.get_current_device().name
    name = device.decode() if isinstance(device, bytes) else device
    print(f"{name}; {os.cpu_count()} cores; numba {numba.__version__}, numpy {np.__version__}")
    folder = Path(tempfile.mkdtemp(prefix="check-gpu-"))
    agrees = [compare_kinds(list(make_experiments())), compare_studies(folder, runs=30)]
    if agrees[1]:
        shutil.rmtree(folder)
    return int(not all(agrees))


if __name__ == "__main__":
    sys.exit(main())
