"""Distribution of the agents of several runs over the worlds of a batch.

A population has `population.worlds` worlds, and each agent has `lifetime.repeats` lifetimes.
World 0 of the first repeat has the key (seed, run) of random numbers. The keys of all other worlds
are drawn with this key, so that a world does not depend on the numbers of worlds and repeats.

The worlds of a batch are ordered by repeat, then by run, then by index in the population. The
first lanes are the agents of the first run in the first repeat. The second run follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import rng
from baldwinlab.experiment import Experiment


class WorldLayout(NamedTuple):
    """Counts and keys of the worlds of a batch."""

    runs: int
    repeats: int  # Number of lifetimes of each agent.
    worlds: int  # Number of worlds of a run in one repeat.
    agents: int  # Number of agents in each world.
    # Key of the random numbers of each world of the batch, [world, 2].
    keys: npt.NDArray[np.uint32]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of simulated populations, and number of agents of each population.

        The populations are ordered by repeat, then by run.
        """
        return self.repeats * self.runs, self.worlds * self.agents

    def distribute(self, genomes: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Return `genomes` [run, agent, module, weight] as [world, agent, module, weight]."""
        n_worlds = self.runs * self.worlds
        genomes_by_world = genomes.reshape(n_worlds, self.agents, *genomes.shape[2:])
        if self.repeats == 1:
            return genomes_by_world
        return np.tile(genomes_by_world, (self.repeats, 1, 1, 1))


def make_world_layout(
    experiment: Experiment, seed: int, runs: Sequence[int], world: int | None = None
) -> WorldLayout:
    """Return the layout of a batch.

    `world`: index of a world of the population. The batch then has only this world of each run, in
    the first repeat. By default, the batch has all worlds and all repeats.
    """
    repeats = experiment.lifetime.repeats
    worlds = experiment.population.worlds
    keys = draw_world_keys(seed, runs, repeats, worlds)
    if world is not None:
        keys = keys[:1, :, world : world + 1]
        repeats = 1
        worlds = 1
    return WorldLayout(
        runs=len(runs),
        repeats=repeats,
        worlds=worlds,
        agents=experiment.agents_per_world,
        keys=keys.reshape(-1, 2),
    )


def draw_world_keys(
    seed: int, runs: Sequence[int], repeats: int, worlds: int
) -> npt.NDArray[np.uint32]:
    """Return the keys of the random numbers of all worlds, uint32 [repeat, run, world, 2]."""
    keys = np.empty((repeats, len(runs), worlds, 2), np.uint32)
    keys[:] = np.array([(seed, run) for run in runs], np.uint32)[:, None]
    if repeats * worlds > 1:
        for index, run in enumerate(runs):
            words = rng.words(seed, run, 0, rng.WORLD, (repeats, worlds))
            keys[:, index] = words[..., :2]
            # The first world of the first repeat has the key of a run with a single world.
            keys[0, index, 0] = seed, run
    return keys


def agents_of_world(experiment: Experiment, world: int) -> slice:
    """Return the slice of the agents of a population that are in a world."""
    n_agents = experiment.agents_per_world
    return slice(world * n_agents, (world + 1) * n_agents)
