"""Compare the results of an NVIDIA GPU with the results of the CPU, and measure its speed.

    python scripts/check_gpu.py [--quick]

The script first simulates every kind of experiment on both, and exits with status 1 if a bit
differs. Then it prints agent-steps per second of complete generations, without compilation, for
several numbers of worlds and threads.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numba
import numpy as np
from numba import cuda as numba_cuda

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cpu, cuda
from baldwinlab.models.miniworld.backends.choice import Batch
from baldwinlab.models.miniworld.state_arrays import named_arrays
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file

WORLD_COUNTS = (1, 30, 180, 528, 1056, 2640, 5280, 10560, 21120)
PARTS_FOLDER = Path(__file__).parents[1] / "examples" / "parts"
THREAD_COUNTS = (32, 64, 128, 256, 512)
FOOD = {"x": [400, 560], "y": [80, 240]}


def make_experiments() -> Iterator[tuple[str, Experiment]]:
    """Yield experiments for every path through the engine, with newborns at the food."""
    for condition in ("evo/A", "evo+self-taught/A", "evo+self-taught/B"):
        yield condition, load(condition)
        yield (
            f"{condition}, at the food",
            load(condition).replace(world={"start": {"x": 480, "y": 160, "radius": 70}}),
        )
    base = load("evo+self-taught/A").replace(world={"start": {"x": 480, "y": 160, "radius": 70}})
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
    """Return the names of arrays that differ between GPU and CPU, without scratch memory."""
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
    names = [name for name in on_cpu if name != "near_agents"]
    return [name for name in names if on_cpu[name].tobytes() != on_gpu[name].tobytes()]


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


def main(quick: bool) -> int:
    if problem := cuda.unavailable_reason():
        print(problem)
        return 1
    device = numba_cuda.get_current_device().name
    name = device.decode() if isinstance(device, bytes) else device
    print(f"{name}; numba {numba.__version__}, {numba_cuda.__name__}")
    failed = 0
    for title, experiment in make_experiments():
        arrays = list_differences(experiment, 40)
        failed += bool(arrays)
        result = f"differs in {', '.join(arrays)}" if arrays else "bit-identical"
        print(f"{title}: {result}", flush=True)
    for condition in ("evo/A", "evo+self-taught/A"):
        for title, start in (
            ("start of the paper", {}),
            ("start at the food", {"start": {"x": 480, "y": 160, "radius": 70}}),
        ):
            experiment = load(condition).replace(world=start)
            world_counts = WORLD_COUNTS[-3:-1] if quick else WORLD_COUNTS
            for worlds in world_counts:
                # With few worlds, the number of threads has no effect.
                thread_counts = (128,) if quick or worlds < 5280 else THREAD_COUNTS
                for threads in thread_counts:
                    cuda.THREADS_PER_BLOCK = threads  # type: ignore[misc]
                    rate = f"{measure_speed(experiment, worlds):.3g} agent-steps/s"
                    setting = f"{worlds} worlds, {threads} threads"
                    print(f"{condition}, {title}: {setting}: {rate}", flush=True)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv))
