"""Measure lifetimes on an NVIDIA GPU: `python -m benchmarks.gpu`, after `make cuda`.

The table has agent-steps per second of complete generations, without compilation, for several
numbers of worlds. JAX is measured on the same GPU, if it supports the GPU.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from baldwinlab.engine.gpu import SIMULATED
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cuda
from baldwinlab.papers.presets import load
from benchmarks.setting import from_experiment

CONDITIONS = ("evo/A", "evo+self-taught/A")
WORLDS = (30, 180, 2_640, 21_120)
JAX_WORLDS = 2_640
AT_THE_FOOD = {"start": {"x": 480, "y": 160, "radius": 70}}
# Number of measured generations, after one that is not counted because it may compile.
N_GENERATIONS = 2


def draw_genomes(experiment: Experiment, worlds: int) -> np.ndarray:
    shape = (worlds, experiment.population.size, len(experiment.modules), experiment.genome_length)
    return np.random.default_rng(1).standard_normal(shape, np.float32)


def measure_rate(simulate: Callable[[int], Any], agent_steps: int) -> str:
    """Return the best rate of `simulate(generation)` as text."""
    seconds = []
    for generation in range(1 + N_GENERATIONS):
        start = time.perf_counter()
        simulate(generation)
        seconds.append(time.perf_counter() - start)
    return f"{agent_steps / min(seconds[1:]):.3g} agent-steps/s"


def measure_speed(experiment: Experiment, worlds: int) -> str:
    """Return the rate of complete generations of a batch."""
    batch = cuda.CudaBatch(experiment, 7, range(worlds))
    genomes = draw_genomes(experiment, worlds)

    def simulate(generation: int) -> None:
        batch.begin(generation, genomes)
        batch.simulate(0, experiment.lifetime.steps)
        batch.eaten_in_life()

    return measure_rate(simulate, worlds * experiment.agent_steps)


def measure_conditions(
    worlds: Sequence[int], changes: Mapping[str, Any], title: str = "start of the paper"
) -> None:
    """Print the rates of two conditions for several numbers of worlds."""
    for condition in CONDITIONS:
        experiment = load(condition).replace(**changes)
        for count in worlds:
            rate = measure_speed(experiment, count)
            print(f"{condition}, {title}, {count} worlds: {rate}", flush=True)


def measure_jax(worlds: int, changes: Mapping[str, Any]) -> None:
    """Print the rates of two conditions in JAX, or why JAX cannot be measured."""
    try:
        import jax

        from benchmarks.contenders import jax_scan
    except ImportError as error:
        print(f"JAX is not measured: {error}")
        return
    if jax.default_backend() != "gpu" and not SIMULATED:
        print("JAX is not measured, because it finds no GPU: pip install 'jax[cuda13]'")
        return
    for condition in CONDITIONS:
        experiment = load(condition).replace(**changes)
        genomes = draw_genomes(experiment, worlds)
        simulate = jax_scan.make_simulation(from_experiment(experiment), genomes, worlds)
        rate = measure_rate(simulate, worlds * experiment.agent_steps)
        print(f"JAX {jax.__version__}, {condition}, {worlds} worlds: {rate}", flush=True)


def main() -> None:
    measure_conditions(WORLDS, {})
    measure_conditions(WORLDS, {"world": AT_THE_FOOD}, "start at the food")
    measure_jax(JAX_WORLDS, {})


if __name__ == "__main__":
    main()
