"""baldwinlab's engine: one thread a core, and on each the lives of two batches of worlds, as a study would run them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

import baldwinlab as bl
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.models.miniworld.backends.cpu import Batch
from baldwinlab.studies.run import available_cores
from benchmarks.setting import Genomes, Live, Setting

BATCHES = 2  # for each core, one after the other


def agent_steps(setting: Setting) -> int:
    return available_cores() * BATCHES * CPU.worlds * setting.agents * setting.steps


def lives(setting: Setting, genomes: Genomes) -> Live:
    experiment = bl.load(setting.name).replace(lifetime={"steps": setting.steps})
    born_with, cores = np.asarray(genomes, np.float32), available_cores()

    batches: dict[int, Batch] = {}  # made once, as for a run, whose generations the calls are

    def live_batch(generation: int, number: int) -> npt.NDArray[np.int32]:
        runs = number * CPU.worlds + np.arange(CPU.worlds)
        if number not in batches:
            batches[number] = Batch(experiment, 0, runs.tolist())
        batch = batches[number]
        batch.begin(generation, born_with[runs % len(born_with)])
        batch.simulate(0, setting.steps)
        eaten: npt.NDArray[np.int32] = batch.eaten_in_life().sum(axis=-1)
        return eaten

    def live_batches(generation: int, core: int) -> npt.NDArray[np.int32]:
        return np.concatenate(
            [live_batch(generation, core * BATCHES + number) for number in range(BATCHES)]
        )

    def live(generation: int) -> npt.NDArray[np.int32]:
        with ThreadPoolExecutor(cores) as pool:
            return np.concatenate(list(pool.map(live_batches, [generation] * cores, range(cores))))

    return live
