"""The launcher for the CPU: Python arrays in, a batch of lives, Python arrays out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import cached_jit, is_cached, resolve_call
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import list_hooks, make_model, make_state, poison_state
from baldwinlab.models.miniworld.lookup import choose_lookup
from baldwinlab.models.miniworld.step import simulate_sequential, simulate_simultaneous


def code_key(experiment: Experiment) -> tuple[Any, ...]:
    """What decides which code an experiment's lives run."""
    parts = [experiment.part(path) for path in ("network.kind", "learning.rule", "motor.body")]
    parts += [*experiment.parts("senses.kinds"), *experiment.parts("world.features")]
    return (*map(type, parts), choose_lookup(experiment), experiment.lifetime.update)


def is_compiled(experiment: Experiment) -> bool:
    """Whether what these lives run has been compiled before, and is kept."""
    return is_cached(_entry_point(experiment), list_hooks(make_state(experiment, 1)))


def _entry_point(experiment: Experiment) -> Any:
    return (
        simulate_sequential if experiment.lifetime.update == "sequential" else simulate_simultaneous
    )


class Batch:
    """Several runs of one experiment that live side by side, a generation at a time. A run's bits do not depend on the others."""

    def __init__(self, experiment: Experiment, seed: int, runs: Sequence[int]) -> None:
        self.model = make_model(experiment, len(runs))
        self.state = make_state(experiment, len(runs))
        self.state.keys[:] = [(seed, run) for run in runs]
        self._kept = self._live = cached_jit(
            _entry_point(experiment), list_hooks(self.state), short_loops=True
        )
        self._shape = (len(runs), experiment.population.size)

    def begin(self, generation: int, genomes: npt.NDArray[np.float32]) -> None:
        """Let a generation be born. `genomes` is [world, agent, module, weight], of `experiment.genome_length` weights."""
        poison_state(self.state, math.prod(self._shape))
        self.state.generation[0] = generation
        self.state.genome[:] = genomes
        arguments = self.model, self.state, True, 0, 0
        self._live(*arguments)
        if self._live is self._kept:
            self._live = resolve_call(self._kept, *arguments)

    def simulate(self, first_step: int, last_step: int) -> None:
        """Live through the steps from `first_step` up to, and without, `last_step`."""
        self._live(self.model, self.state, False, first_step, last_step)

    def items(self) -> npt.NDArray[np.float32]:
        """Where the items lie, [world, item, (x, y)]."""
        return np.stack([self.state.item_x, self.state.item_y], axis=-1)

    def eaten_in_life(self) -> npt.NDArray[np.int32]:
        """Items eaten so far in this life, [world, agent, region]."""
        worlds, agents = self._shape
        return self.state.eaten_in_life[:, : worlds * agents].T.reshape(worlds, agents, -1).copy()

    def weights(self) -> npt.NDArray[np.float32]:
        """The action module's weights as they stand, [world, agent, weight]."""
        worlds, agents = self._shape
        return self.state.weights[:, : worlds * agents].T.reshape(worlds, agents, -1).copy()


def compile_simulation(experiment: Experiment) -> None:
    """Compile what these lives run, if it is not kept: a batch of one world lives for a step."""
    batch = Batch(experiment, seed=0, runs=[0])
    batch.begin(
        0,
        np.zeros(
            (1, experiment.population.size, len(experiment.modules), experiment.genome_length),
            np.float32,
        ),
    )
    batch.simulate(0, 1)
