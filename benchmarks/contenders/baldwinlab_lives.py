"""The engine of baldwinlab: one thread per core, each with two batches of worlds, as in a study."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

import baldwinlab as bl
from baldwinlab.engine.threads import available_cores
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from benchmarks.setting import Genomes, Setting, Simulate

# Per core, one after the other.
BATCHES = 2


def agent_steps(setting: Setting) -> int:
    return available_cores() * BATCHES * CPU.worlds * setting.agents * setting.steps


def prepare(setting: Setting, genomes: Genomes) -> Simulate:
    experiment = bl.load(setting.name).replace(lifetime={"steps": setting.steps})
    newborns = np.asarray(genomes, np.float32)
    cores = available_cores()
    # A batch is created once, as in a run. Each call is a generation.
    batches: dict[int, CpuBatch] = {}

    def simulate_batch(generation: int, number: int) -> npt.NDArray[np.int32]:
        runs = number * CPU.worlds + np.arange(CPU.worlds)
        if number not in batches:
            batches[number] = CpuBatch(experiment, 0, runs.tolist())
        batch = batches[number]
        batch.begin(generation, newborns[runs % len(newborns)])
        batch.simulate(0, setting.steps)
        eaten: npt.NDArray[np.int32] = batch.eaten_in_life().sum(axis=-1)
        return eaten

    def simulate_batches(generation: int, core: int) -> npt.NDArray[np.int32]:
        return np.concatenate(
            [simulate_batch(generation, core * BATCHES + number) for number in range(BATCHES)]
        )

    def simulate(generation: int) -> npt.NDArray[np.int32]:
        with ThreadPoolExecutor(cores) as pool:
            return np.concatenate(
                list(pool.map(simulate_batches, [generation] * cores, range(cores)))
            )

    return simulate
