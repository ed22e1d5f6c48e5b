"""Compare the results and the speed of an NVIDIA GPU with those of the CPU.

    python scripts/check_gpu.py [--quick]

First every kind of life, on both; the script ends with status 1 if any bit differs. Then agent-steps a second of whole
generations (genomes in, 5000 steps, what was eaten out; compilation apart) for several numbers of worlds and threads.
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
from baldwinlab.models.miniworld.allocation import named_arrays
from baldwinlab.models.miniworld.backends import cpu, cuda
from baldwinlab.models.miniworld.backends.choice import Batch
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file

WORLDS = (1, 30, 180, 528, 1056, 2640, 5280, 10560, 21120)
PARTS = Path(__file__).parents[1] / "examples" / "parts"
THREADS = (32, 64, 128, 256, 512)
FOOD = {"x": [400, 560], "y": [80, 240]}


def experiments() -> Iterator[tuple[str, Experiment]]:
    """Every path through the engine, with newborns where the food is."""
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
        load_file(PARTS / f"{name}.py")
    walls = {"features": ["poison", "obstacles"], "obstacles": {"x": [470, 490], "y": [100, 220]}}
    yield "social", base.replace(learning={"rule": "social"})
    yield "poison and walls", base.replace(world=walls, senses={"kinds": ["food", "poison"]})
    yield "memory", base.replace(network={"kind": "elman"})
    yield (
        "items round the edge",
        base.replace(world={"food": [{"x": [0, 640], "y": [0, 640], "count": 700}]}),
    )


def genomes(experiment: Experiment, worlds: int) -> np.ndarray:
    shape = (worlds, experiment.population.size, len(experiment.modules), experiment.genome_length)
    return np.random.default_rng(1).standard_normal(shape, np.float32)


def differences(experiment: Experiment, worlds: int) -> list[str]:
    """The names of what is not the same after a life on the GPU and on the CPU; `awake` is scratch."""
    batches: list[Batch] = [
        cpu.Batch(experiment, 7, range(worlds)),
        cuda.Batch(experiment, 7, range(worlds)),
    ]
    for batch in batches:
        batch.begin(3, genomes(experiment, worlds))
        batch.simulate(0, experiment.lifetime.steps)
    one, other = (
        named_arrays(batch.state, worlds, experiment.population.size) for batch in batches
    )
    return [
        name
        for name, array in one.items()
        if name != "awake" and array.tobytes() != other[name].tobytes()
    ]


def speed(experiment: Experiment, worlds: int) -> float:
    """Agent-steps a second of whole generations, the best of three."""
    batch, made = cuda.Batch(experiment, 7, range(worlds)), genomes(experiment, worlds)
    seconds = []
    for generation in range(4):  # the first may compile
        began = time.perf_counter()
        batch.begin(generation, made)
        batch.simulate(0, experiment.lifetime.steps)
        batch.eaten_in_life()
        seconds.append(time.perf_counter() - began)
    return worlds * experiment.population.size * experiment.lifetime.steps / min(seconds[1:])


def main(quick: bool) -> int:
    if problem := cuda.available():
        print(problem)
        return 1
    name = numba_cuda.get_current_device().name
    print(
        f"{name.decode() if isinstance(name, bytes) else name}; numba {numba.__version__}, {numba_cuda.__name__}"
    )
    failed = 0
    for title, experiment in experiments():
        found = differences(experiment, 40)
        failed += bool(found)
        print(
            f"{title}: {'differs in ' + ', '.join(found) if found else 'the same bits'}", flush=True
        )
    for condition in ("evo/A", "evo+self-taught/A"):
        for place, start in (
            ("of the paper", {}),
            ("at the food", {"start": {"x": 480, "y": 160, "radius": 70}}),
        ):
            experiment = load(condition).replace(world=start)
            for worlds in WORLDS[-3:-1] if quick else WORLDS:
                for threads in (128,) if quick or worlds < 5280 else THREADS:
                    cuda.THREADS = threads  # type: ignore[misc]
                    print(
                        f"{condition} {place}: {worlds} worlds, {threads} threads: {speed(experiment, worlds):.3g} /s",
                        flush=True,
                    )
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv))
