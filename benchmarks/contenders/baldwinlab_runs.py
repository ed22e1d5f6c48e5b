"""Complete runs of baldwinlab with evolution: on each core, a batch of runs of 100 generations."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

import baldwinlab as bl
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation.simulate import simulate_batch
from baldwinlab.studies.run import available_cores, count_agent_steps
from benchmarks.setting import Genomes, Setting, Simulate


def agent_steps(setting: Setting) -> int:
    return available_cores() * CPU.worlds * count_agent_steps(bl.load(setting.name))


def prepare(setting: Setting, genomes: Genomes) -> Simulate:
    """Return a function that simulates runs; `genomes` are not used, because runs evolve."""
    experiment = bl.load(setting.name)
    cores = available_cores()

    def run_batch(seed: int, core: int) -> npt.NDArray[np.int32]:
        runs = range(core * CPU.worlds, (core + 1) * CPU.worlds)
        return np.concatenate(
            [run["food_eaten"].values for run in simulate_batch(experiment, seed, runs)]
        )

    def simulate(seed: int) -> npt.NDArray[np.int32]:
        with ThreadPoolExecutor(cores) as pool:
            return np.concatenate(list(pool.map(run_batch, [seed] * cores, range(cores))))

    return simulate
