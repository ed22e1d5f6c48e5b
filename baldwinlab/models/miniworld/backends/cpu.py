"""Backend for the CPU: blocks of worlds, and a team of threads that simulates one large world."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.atomics import Team
from baldwinlab.engine.elements import select_element
from baldwinlab.engine.jit import cached_jit, is_cached, resolve_call
from baldwinlab.engine.phases import hook_functions
from baldwinlab.engine.simd import WIDTH
from baldwinlab.engine.threads import count_threads, run_in_ranges, run_in_threads
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.miniworld import count_worlds
from baldwinlab.experiment.species import require_single_species
from baldwinlab.models.miniworld.allocation import (
    find_array,
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
from baldwinlab.models.miniworld.step import (
    simulate_sequential_blocks,
    simulate_simultaneous_blocks,
)
from baldwinlab.models.miniworld.world_layout import make_world_layout

# Minimum number of agents of a large world.
MIN_AGENTS: Final = 2_000
# Minimum number of agents of a thread. With fewer agents, barriers take as long as the simulation.
MIN_AGENTS_PER_THREAD: Final = 500
# Maximum number of worlds in a block. With 20 agents per world, the weights of 4 worlds (80 lanes)
# fit the first-level cache.
BLOCK_WORLDS: Final = 4


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
    if experiment.lifetime.update == "sequential":
        return simulate_sequential_blocks
    return simulate_simultaneous_blocks


class PopulationView:
    """The agents of simulated populations, with arrays in the memory of the CPU."""

    def __init__(self, model: MiniWorldModel, state: State, shape: tuple[int, int]) -> None:
        """Store the arguments. `shape` is (populations, agents of each population)."""
        self.model = model
        self.state = state
        self._shape = shape

    def items(self) -> npt.NDArray[np.float32]:
        """Return the positions of the items, [world, item, (x, y)]."""
        return np.stack([self.by_world("item_x"), self.by_world("item_y")], axis=-1)

    def eaten_in_life(self) -> npt.NDArray[np.int32]:
        """Return the numbers of eaten items, [population, agent, row of `State.eaten_in_life`]."""
        return self.by_agent("eaten_in_life")

    def weights(self) -> npt.NDArray[np.float32]:
        """Return the current weights of the action module, [population, agent, weight]."""
        return self.by_agent("weights")

    def positions(self) -> npt.NDArray[np.float32]:
        """Return the current positions of the agents, [population, agent, (x, y)]."""
        return self.by_agent("positions")

    def by_agent(self, name: str) -> npt.NDArray[Any]:
        """Return a copy [population, agent, row] of an array [row, lane] of the state.

        `name`: path of the array, see `find_array`.
        """
        array: npt.NDArray[Any] = find_array(self.state, name)
        lanes = slice(math.prod(self._shape))
        return array[:, lanes].T.reshape(*self._shape, len(array)).copy()

    def by_world(self, name: str) -> npt.NDArray[Any]:
        """Return a copy of an array [world, ...] of the state."""
        array: npt.NDArray[Any] = find_array(self.state, name)
        return array.copy()


class CpuBatch(PopulationView):
    """Several runs of one experiment, simulated one generation at a time. Runs are independent.

    The arrays of `states` have the first dimension `block`. One call simulates all blocks of
    worlds, and the threads of the context share the blocks. `state` has views of the first block.
    """

    def __init__(
        self,
        experiment: Experiment,
        seed: int,
        runs: Sequence[int],
        world: int | None = None,
        max_worlds: int | None = None,
    ) -> None:
        """Allocate the worlds.

        `max_worlds`: maximum number of worlds of a block. By default, one block has all worlds. The
        other arguments are those of `make_world_layout`.
        """
        require_single_species(experiment, "a batch of one species")
        self._n_runs = len(runs)
        self._block_runs = self._n_runs
        if max_worlds is not None:
            self._block_runs = choose_block_runs(experiment, self._n_runs, max_worlds)
        self._n_blocks = math.ceil(self._n_runs / self._block_runs)
        # The last run fills the last block.
        self._run_indices = np.arange(self._n_blocks * self._block_runs).clip(max=len(runs) - 1)
        layouts = [
            make_world_layout(experiment, seed, [runs[index] for index in indices], world)
            for indices in self._run_indices.reshape(self._n_blocks, -1)
        ]
        self._layout = layouts[0]
        n_worlds = len(self._layout.keys)
        model = make_model(experiment, n_worlds)
        self.states = make_state(experiment, n_worlds, blocks=self._n_blocks)
        self.states.keys[:] = [layout.keys for layout in layouts]
        super().__init__(model, select_element(self.states, 0), self._layout.shape)
        self._team: TeamSimulation | None = None
        if uses_team(experiment, n_worlds):
            self._team = TeamSimulation(model, self.state)
        else:
            self._compiled = self._compile(experiment)

    def _compile(self, experiment: Experiment) -> Callable[..., None]:
        dispatcher = cached_jit(_entry_point(experiment), list_hooks(self.state), short_loops=True)
        # This call compiles the function. The range of blocks is empty.
        arguments = self.model, self.states, False, 0, 0, 0, 0
        dispatcher(*arguments)
        return resolve_call(dispatcher, *arguments)

    def begin(self, generation: int, genomes: npt.NDArray[np.float32]) -> None:
        """Initialize a generation with genomes [run, agent, module, weight]."""
        if poison.is_on():
            for block in range(self._n_blocks):
                poison_state(select_element(self.states, block), math.prod(self._shape))
        self.states.generation[:] = generation
        if len(genomes) < len(self._run_indices):
            genomes = genomes[self._run_indices]
        n_blocks, repeats, block_runs = self._n_blocks, self._layout.repeats, self._block_runs
        genomes_of_blocks = genomes.reshape(n_blocks, 1, block_runs, *genomes.shape[1:])
        # All repeats of a lifetime have the same genomes.
        shape = n_blocks, repeats, *genomes_of_blocks.shape[2:]
        self.states.genome.reshape(shape)[:] = genomes_of_blocks
        self._simulate(is_start=True, first_step=0, last_step=0)

    def simulate(self, first_step: int, last_step: int) -> None:
        """Simulate the steps from `first_step` to `last_step` - 1."""
        self._simulate(is_start=False, first_step=first_step, last_step=last_step)

    def _simulate(self, *, is_start: bool, first_step: int, last_step: int) -> None:
        """Simulate steps of all blocks. If `is_start`, initialize the generation first."""
        steps = is_start, first_step, last_step
        if self._team is not None:
            self._team(self.model, self.state, *steps)
            return
        simulate = partial(self._compiled, self.model, self.states, *steps)
        if first_step == last_step:
            # The start of a lifetime takes less time than the start of threads.
            simulate(0, self._n_blocks)
        else:
            run_in_ranges(simulate, self._n_blocks, 1)

    def by_agent(self, name: str) -> npt.NDArray[Any]:
        """Return a copy [population, agent, row] of an array [row, lane] of the states."""
        array = find_array(self.states, name)
        populations, agents = self._shape
        n_rows = array.shape[1]
        shape = self._n_blocks, n_rows, self._layout.repeats, self._block_runs, agents
        values = array[:, :, : populations * agents].reshape(shape)
        return self._order_runs(values.transpose(2, 0, 3, 4, 1))

    def by_world(self, name: str) -> npt.NDArray[Any]:
        """Return a copy [world, ...] of an array of the states."""
        array = find_array(self.states, name)
        worlds_of_run = self._layout.worlds
        rows = array.shape[2:]
        shape = self._n_blocks, self._layout.repeats, self._block_runs, worlds_of_run, *rows
        by_population = self._order_runs(array.reshape(shape).swapaxes(0, 1))
        return by_population.reshape(len(by_population) * worlds_of_run, *rows)

    def _order_runs(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return a copy [population, ...] of [repeat, block, run in the block, ...]."""
        repeats, n_blocks, block_runs, *rows = values.shape
        by_run = values.copy().reshape(repeats, n_blocks * block_runs, *rows)
        return by_run[:, : self._n_runs].reshape(repeats * self._n_runs, *rows)


def choose_block_runs(experiment: Experiment, n_runs: int, max_worlds: int) -> int:
    """Return the number of runs in each block with which a batch has the fewest SIMD blocks."""
    worlds_of_run = experiment.lifetime.repeats * experiment.population.worlds
    max_runs = min(n_runs, max(1, max_worlds // worlds_of_run))

    def count_simd_blocks(block_runs: int) -> int:
        n_lanes = block_runs * worlds_of_run * experiment.agents_per_world
        return math.ceil(n_runs / block_runs) * math.ceil(n_lanes / WIDTH)

    # Of equal counts, the largest block wins, because fewer blocks need fewer calls.
    return min(range(max_runs, max_runs // 2, -1), key=count_simd_blocks)


def make_batch(experiment: Experiment, seed: int, runs: Sequence[int]) -> CpuBatch:
    """Return a batch of runs in blocks of a few worlds."""
    return CpuBatch(experiment, seed, runs, max_worlds=BLOCK_WORLDS)


def compile_simulation(experiment: Experiment) -> None:
    """Compile the code of an experiment, or load the code from the cache.

    The compilation happens in the simulation of one step of one world.
    """
    batch = CpuBatch(experiment, seed=0, runs=[0])
    shape = (1, experiment.population.size, len(experiment.modules), experiment.genome_length)
    batch.begin(generation=0, genomes=np.zeros(shape, np.float32))
    batch.simulate(0, 1)
