"""Measure the kernels of an NVIDIA GPU: `python -m benchmarks.gpu`, after `make cuda`.

The table has agent-steps per second of complete generations, without compilation, for several
numbers of worlds.
"""

from __future__ import annotations

import time

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cuda
from baldwinlab.papers.presets import load
from scripts import check_gpu

SPEED_WORLDS = (30, 180, 2640, 21120)


def measure_speed(experiment: Experiment, worlds: int) -> float:
    """Return agent-steps per second of complete generations, the best of three."""
    batch = cuda.CudaBatch(experiment, 7, range(worlds))
    population = check_gpu.draw_genomes(experiment, worlds)
    seconds = []
    # The first generation may compile, so it is not counted.
    for generation in range(4):
        start_time = time.perf_counter()
        batch.begin(generation, population)
        batch.simulate(0, experiment.lifetime.steps)
        batch.eaten_in_life()
        seconds.append(time.perf_counter() - start_time)
    return worlds * experiment.population.size * experiment.lifetime.steps / min(seconds[1:])


def main() -> None:
    for condition in ("evo/A", "evo+self-taught/A"):
        for title, world in (
            ("start of the paper", {}),
            ("start at the food", check_gpu.AT_THE_FOOD),
        ):
            experiment = load(condition).replace(world=world)
            for worlds in SPEED_WORLDS:
                rate = f"{measure_speed(experiment, worlds):.3g} agent-steps/s"
                print(f"{condition}, {title}: {worlds} worlds: {rate}", flush=True)


if __name__ == "__main__":
    main()
