"""baldwinlab's engine: one thread a core, and on each the lives of two blocks of worlds, as a study would run them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

import baldwinlab as bl
from baldwinlab.models.miniworld.backend import CPU
from baldwinlab.models.miniworld.cpu import Block
from baldwinlab.studies.study import available_cores
from benchmarks.setting import Genomes, Live, Setting

BLOCKS = 2  # for each core, one after the other


def agent_steps(setting: Setting) -> int:
    return available_cores() * BLOCKS * CPU.worlds * setting.agents * setting.steps


def lives(setting: Setting, genomes: Genomes) -> Live:
    experiment = bl.load(setting.name).replace(lifetime={"steps": setting.steps})
    born_with, cores = np.asarray(genomes, np.float32), available_cores()

    def live_block(seed: int, number: int) -> npt.NDArray[np.int32]:
        runs = number * CPU.worlds + np.arange(CPU.worlds)
        block = Block(experiment, seed, runs.tolist())
        block.begin(0, born_with[runs % len(born_with)])
        block.live(0, setting.steps)
        eaten: npt.NDArray[np.int32] = block.eaten().sum(axis=-1)
        return eaten

    def live_blocks(seed: int, core: int) -> npt.NDArray[np.int32]:
        return np.concatenate([live_block(seed, core * BLOCKS + number) for number in range(BLOCKS)])

    def live(seed: int) -> npt.NDArray[np.int32]:
        with ThreadPoolExecutor(cores) as pool:
            return np.concatenate(list(pool.map(live_blocks, [seed] * cores, range(cores))))

    return live
