"""Backend for the CPU: a batch of worlds with arrays of NumPy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import cached_jit, is_cached, resolve_call
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.miniworld import count_worlds
from baldwinlab.experiment.species import require_single_species
from baldwinlab.models.miniworld.allocation import (
    list_part_classes,
    make_model,
    make_state,
)
from baldwinlab.models.miniworld.backends.team import TeamSimulation, team_hooks, uses_team
from baldwinlab.models.miniworld.parallel_step import simulate_in_team
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.models.miniworld.state_arrays import list_hooks, poison_state
from baldwinlab.models.miniworld.step import simulate_sequential, simulate_simultaneous
from baldwinlab.models.miniworld.world_layout import make_world_layout


def code_key(experiment: Experiment) -> tuple[Any, ...]:
    """Return the values that select the compiled code of an experiment."""
    return (
        *list_part_classes(experiment),
        experiment.lifetime.update,
        uses_team(experiment, count_worlds(experiment)),
    )


def is_compiled(experiment: Experiment) -> bool:
    """Return whether the code of an experiment is in the cache."""
    state = make_state(experiment, 1)
    if uses_team(experiment, count_worlds(experiment)):
        return is_cached(simulate_in_team, team_hooks(state))
    return is_cached(_entry_point(experiment), list_hooks(state))


def _entry_point(experiment: Experiment) -> Any:
    """Return the function that simulates steps."""
    return (
        simulate_sequential if experiment.lifetime.update == "sequential" else simulate_simultaneous
    )


class PopulationView:
    """The agents of simulated populations, whose arrays are in the memory of the CPU."""

    def __init__(self, model: MiniWorldModel, state: State, shape: tuple[int, int]) -> None:
        """`shape` is the number of populations, and the number of agents of each population."""
        self.model = model
        self.state = state
        self._shape = shape

    def items(self) -> npt.NDArray[np.float32]:
        """Return the positions of the items, [world, item, (x, y)]."""
        return np.stack([self.state.item_x, self.state.item_y], axis=-1)

    def eaten_in_life(self) -> npt.NDArray[np.int32]:
        """Return the items and agents eaten in this lifetime, [population, agent, eaten kind]."""
        return self._by_agent(self.state.eaten_in_life)

    def weights(self) -> npt.NDArray[np.float32]:
        """Return the current weights of the action module, [population, agent, weight]."""
        return self._by_agent(self.state.weights)

    def positions(self) -> npt.NDArray[np.float32]:
        """Return the current positions of the agents, [population, agent, (x, y)]."""
        return self._by_agent(self.state.positions)

    def _by_agent(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return a copy [population, agent, row] of an array [row, lane]."""
        lanes = slice(math.prod(self._shape))
        return array[:, lanes].T.reshape(*self._shape, len(array)).copy()


class CpuBatch(PopulationView):
    """Several runs of one experiment, simulated one generation at a time. Runs are independent."""

    def __init__(
        self, experiment: Experiment, seed: int, runs: Sequence[int], world: int | None = None
    ) -> None:
        """Allocate the worlds of a layout (`make_world_layout`)."""
        require_single_species(experiment, "a batch of one species")
        self._layout = make_world_layout(experiment, seed, runs, world)
        n_worlds = len(self._layout.keys)
        model = make_model(experiment, n_worlds)
        super().__init__(model, make_state(experiment, n_worlds), self._layout.shape)
        self.state.keys[:] = self._layout.keys
        self._dispatcher: Any = None
        if uses_team(experiment, n_worlds):
            self._function: Any = TeamSimulation(self.model, self.state)
        else:
            self._dispatcher = cached_jit(
                _entry_point(experiment), list_hooks(self.state), short_loops=True
            )
            self._function = self._dispatcher

    def begin(self, generation: int, genomes: npt.NDArray[np.float32]) -> None:
        """Initialize a generation with genomes [run, agent, module, weight]."""
        poison_state(self.state, math.prod(self._shape))
        self.state.generation[0] = generation
        self.state.genome[:] = self._layout.distribute(genomes)
        is_start = True
        arguments = self.model, self.state, is_start, 0, 0
        self._function(*arguments)
        # The first call compiles the function. Later calls skip the dispatcher.
        if self._function is self._dispatcher:
            self._function = resolve_call(self._dispatcher, *arguments)

    def simulate(self, first_step: int, last_step: int) -> None:
        """Simulate the steps from `first_step` to `last_step` - 1."""
        is_start = False
        self._function(self.model, self.state, is_start, first_step, last_step)


def compile_simulation(experiment: Experiment) -> None:
    """Compile the code of an experiment, or load it from the cache.

    The compilation happens in the simulation of one step of one world.
    """
    batch = CpuBatch(experiment, seed=0, runs=[0])
    shape = (1, experiment.population.size, len(experiment.modules), experiment.genome_length)
    batch.begin(generation=0, genomes=np.zeros(shape, np.float32))
    batch.simulate(0, 1)
