"""Backend for the CPU: a batch of worlds, and a team of threads that simulates one large world."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.atomics import Team
from baldwinlab.engine.jit import cached_jit, is_cached, resolve_call
from baldwinlab.engine.phases import hook_functions
from baldwinlab.engine.simd import WIDTH
from baldwinlab.engine.threads import count_threads, run_in_threads
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.miniworld import count_worlds
from baldwinlab.experiment.species import require_single_species
from baldwinlab.models.miniworld.allocation import (
    list_hooks,
    list_part_classes,
    make_model,
    make_state,
    poison_state,
    reads_other_agents,
)
from baldwinlab.models.miniworld.parallel_step import (
    DependentAgents,
    IndependentAgents,
    SharedArrays,
    simulate_in_team,
)
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.models.miniworld.step import simulate_sequential, simulate_simultaneous
from baldwinlab.models.miniworld.world_layout import make_world_layout

# Minimum number of agents of a large world.
MIN_AGENTS: Final = 2_000
# Minimum number of agents of a thread. With fewer agents, barriers take as long as the simulation.
MIN_AGENTS_PER_THREAD: Final = 500


def is_large(experiment: Experiment, worlds: int) -> bool:
    """Return whether a batch is one large world of one species, which a team can simulate."""
    return (
        worlds == 1
        and experiment.agents_per_world >= MIN_AGENTS
        and experiment.lifetime.update == "simultaneous"
        and not experiment.population.species
    )


def uses_team(experiment: Experiment, worlds: int) -> bool:
    """Return whether several threads of the context simulate a batch.

    On one thread, the ordinary step gives the same bits in less time.
    """
    agents = experiment.agents_per_world
    return is_large(experiment, worlds) and count_threads(agents, MIN_AGENTS_PER_THREAD) > 1


def team_hooks(state: State) -> tuple[Any, ...]:
    """Return the types and the hooks of the parts and agents, for the code of a team."""
    agents_class: Any = _agents_class(state)
    return (*list_hooks(state), agents_class, *hook_functions(agents_class.part))


def _agents_class(state: State) -> Any:
    return DependentAgents if reads_other_agents(state) else IndependentAgents


class TeamSimulation:
    """Simulation of steps of a world by all threads of a team."""

    def __init__(self, model: MiniWorldModel, state: State) -> None:
        """Allocate the shared arrays. The context determines the number of threads."""
        threads = count_threads(model.agents, MIN_AGENTS_PER_THREAD)
        cells = int(model.region_cells[-1])
        self._arrivals = np.zeros(1, np.int64)
        # `_replace` below sets the team of each thread. The threads share all arrays.
        shared = SharedArrays(
            team=Team(0, threads, self._arrivals),
            counts=poison.empty((threads, cells), np.int32),
            totals=poison.empty(threads, np.int64),
        )
        claims = poison.empty((1, int(model.region_items[-1])), np.int64)
        self._threads = [
            _agents_of_thread(
                model, state, claims, shared._replace(team=Team(thread, threads, self._arrivals))
            )
            for thread in range(threads)
        ]
        dispatcher = cached_jit(simulate_in_team, team_hooks(state), short_loops=True)
        arguments = self._threads[0], model, state, False, 0, 0
        # This call compiles the function. The range of steps is empty.
        dispatcher(*arguments)
        self._function = resolve_call(dispatcher, *arguments)

    def __call__(
        self, model: MiniWorldModel, state: State, is_start: bool, first_step: int, last_step: int
    ) -> None:
        """Simulate steps. The arguments are those of `simulate_simultaneous`."""

        def simulate(thread: int) -> None:
            agents = self._threads[thread]
            self._function(agents, model, state, is_start, first_step, last_step)

        # The number of arrivals at barriers must start at 0 in each call.
        self._arrivals[0] = 0
        run_in_threads(simulate, len(self._threads))


def _agents_of_thread(
    model: MiniWorldModel, state: State, claims: npt.NDArray[np.int64], shared: SharedArrays
) -> Any:
    """Return the ranges of lanes and agents of a thread, which simulates whole SIMD blocks."""
    blocks = state.positions.shape[1] // WIDTH
    thread, threads, _ = shared.team
    first_lane = blocks * thread // threads * WIDTH
    end_lane = blocks * (thread + 1) // threads * WIDTH
    return _agents_class(state)(
        first_lane=first_lane,
        end_lane=end_lane,
        lanes_per_block=WIDTH,
        first_world=0,
        end_world=1,
        first_agent=min(first_lane, model.agents),
        end_agent=min(end_lane, model.agents),
        claims=claims,
        shared=shared,
    )


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
    """Return the function that simulates steps without a team."""
    return (
        simulate_sequential if experiment.lifetime.update == "sequential" else simulate_simultaneous
    )


class PopulationView:
    """The agents of simulated populations, with arrays in the memory of the CPU."""

    def __init__(self, model: MiniWorldModel, state: State, shape: tuple[int, int]) -> None:
        """Store the arguments. `shape` is (populations, agents of each population)."""
        self.model = model
        self.state = state
        self._shape = shape

    def items(self) -> npt.NDArray[np.float32]:
        """Return the positions of the items, [world, item, (x, y)]."""
        return np.stack([self.state.item_x, self.state.item_y], axis=-1)

    def eaten_in_life(self) -> npt.NDArray[np.int32]:
        """Return the numbers of eaten items, [population, agent, row of `State.eaten_in_life`]."""
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
        """Allocate the worlds. The arguments are those of `make_world_layout`."""
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
    """Compile the code of an experiment, or load the code from the cache.

    The compilation happens in the simulation of one step of one world.
    """
    batch = CpuBatch(experiment, seed=0, runs=[0])
    shape = (1, experiment.population.size, len(experiment.modules), experiment.genome_length)
    batch.begin(generation=0, genomes=np.zeros(shape, np.float32))
    batch.simulate(0, 1)
