"""Team of threads that simulates one large world."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.atomics import Team
from baldwinlab.engine.jit import cached_jit, resolve_call
from baldwinlab.engine.phases import hook_functions
from baldwinlab.engine.simd import WIDTH
from baldwinlab.engine.threads import count_threads, run_in_threads
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.parallel_items import SharedArrays
from baldwinlab.models.miniworld.parallel_step import (
    DependentAgents,
    IndependentAgents,
    simulate_in_team,
)
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.models.miniworld.state_arrays import list_hooks, reads_other_agents

# Minimum number of agents of a large world.
MIN_AGENTS: Final = 2_000
# Minimum number of agents of a thread. With fewer agents, a step takes as long as its barriers.
MIN_AGENTS_PER_THREAD: Final = 500


def is_large(experiment: Experiment, worlds: int) -> bool:
    """Return whether a team can simulate a batch: a single large world, all agents at a time."""
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
    """Return the types and hooks that the step of a team compiles."""
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
        # This call compiles the function. It simulates no step.
        dispatcher(*arguments)
        self._function = resolve_call(dispatcher, *arguments)

    def __call__(
        self, model: MiniWorldModel, state: State, is_start: bool, first_step: int, last_step: int
    ) -> None:
        """Simulate steps. The arguments are those of `simulate_simultaneous`."""

        def simulate(thread: int) -> None:
            agents = self._threads[thread]
            self._function(agents, model, state, is_start, first_step, last_step)

        self._arrivals[0] = 0
        run_in_threads(simulate, len(self._threads))


def _agents_of_thread(
    model: MiniWorldModel, state: State, claims: npt.NDArray[np.int64], shared: SharedArrays
) -> Any:
    """Return the agents of a thread: whole SIMD blocks."""
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
