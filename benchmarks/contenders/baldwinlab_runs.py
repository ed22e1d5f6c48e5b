"""baldwinlab's whole runs, evolution included: on each core a batch of runs of 100 generations, as in the paper."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

import baldwinlab as bl
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation.simulate import simulate_batch
from baldwinlab.studies.run import agent_steps_of_run, available_cores
from benchmarks.setting import Genomes, Live, Setting


def agent_steps(setting: Setting) -> int:
    return available_cores() * CPU.worlds * agent_steps_of_run(bl.load(setting.name))


def lives(setting: Setting, genomes: Genomes) -> Live:
    """`genomes` are not needed: every run begins with its own."""
    experiment, cores = bl.load(setting.name), available_cores()

    def run_batch(seed: int, core: int) -> npt.NDArray[np.int32]:
        runs = range(core * CPU.worlds, (core + 1) * CPU.worlds)
        return np.concatenate(
            [run["food_eaten"].values for run in simulate_batch(experiment, seed, runs)]
        )

    def live(seed: int) -> npt.NDArray[np.int32]:
        with ThreadPoolExecutor(cores) as pool:
            return np.concatenate(list(pool.map(run_batch, [seed] * cores, range(cores))))

    return live
