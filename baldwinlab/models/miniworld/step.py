"""Take one time step: the phases of the paper, in its order. All backends use this code.

A lifetime is a pure function of the experiment, the seed, the run, the generation and the genomes.

The type of the argument `agents` selects the agents that take a step:

- `AllAgents`: all agents of a batch, one SIMD block at a time, phase by phase.
- `SingleAgent`: one agent, for the sequential update (R7).
- A backend can add its own types (`cuda_kernels.py`), which contain its barriers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import for_each_part, hook
from baldwinlab.engine.reference import as_pointer
from baldwinlab.engine.simd import Lane, get, lanes_in_block, simd_block
from baldwinlab.models.miniworld.birth import init_generation
from baldwinlab.models.miniworld.items import eat_items, resort_stale_cells
from baldwinlab.models.miniworld.lookup import compute_outputs
from baldwinlab.models.miniworld.map import ZERO, apply_motor_noise, move_agents
from baldwinlab.models.miniworld.senses.perception import (
    list_near_agents,
    mark_agents_near_regions,
    perceive,
)
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.bodies import choose_action
from baldwinlab.parts.learning_rules import learn, observe_others
from baldwinlab.parts.senses import prepare_senses
from baldwinlab.parts.world_features import end_step

end_step_of_features = for_each_part(end_step)
prepare_all_senses = for_each_part(prepare_senses)


@hook
def lane_of(agents: Any, first: int) -> Lane:
    """Return the lanes that start with `first`: one lane, or a SIMD block."""
    return first


@hook
def prepare_senses_per_world(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Per world: call `prepare_senses` of all senses, before any agent senses."""


@hook
def observe_others_per_world(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Per world: call `observe_others` of the learning rule, after all actions."""


@hook
def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Let the agents eat. The first agent in the order of the step gets a touched item."""


@compiled
def take_step(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Sense, compute the outputs, act, learn and eat."""
    sense_environment(agents, model, state, step)
    for first in range(agents.first, agents.last, agents.stride):
        compute_outputs(state.lookup, model, state, lane_of(agents, first))
    act_and_learn(agents, model, state, step)


@compiled
def sense_environment(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Set the inputs of the agents."""
    for first in range(agents.first, agents.last, agents.stride):
        mark_agents_near_regions(model, state, lane_of(agents, first))
    prepare_senses_per_world(agents, model, state, step)
    for world in range(agents.first_world, agents.last_world):
        for number in range(
            list_near_agents(model, state, world, agents.first_agent, agents.last_agent)
        ):
            perceive(
                model,
                state,
                world,
                get(state.near_agents, 0, world * model.agents + agents.first_agent + number),
            )


@compiled
def act_and_learn(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Act on the outputs, then learn and eat."""
    for first in range(agents.first, agents.last, agents.stride):
        choose_action(state.body, model, state, lane_of(agents, first))
    if model.action_noise > ZERO:
        for world in range(agents.first_world, agents.last_world):
            for agent in range(agents.first_agent, agents.last_agent):
                apply_motor_noise(model, state, world, world * model.agents + agent, agent, step)
    for first in range(agents.first, agents.last, agents.stride):
        move_agents(state.features, model, state, lane_of(agents, first))
    observe_others_per_world(agents, model, state, step)
    if step < model.learning_steps:
        for first in range(agents.first, agents.last, agents.stride):
            learn(state.rule, model, state, step, lane_of(agents, first))
    eat_all(agents, model, state, step)


class _AllAgents:
    """Hooks for all agents of a batch, which act at the same time."""

    @staticmethod
    def lane_of(agents: Any, first: int) -> Lane:
        return simd_block(first)

    @staticmethod
    def prepare_senses_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        for world in range(model.worlds):
            prepare_all_senses(state.senses, model, state, world, step)

    @staticmethod
    def observe_others_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        for world in range(model.worlds):
            observe_others(state.rule, model, state, world, step)

    @staticmethod
    def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
        for world in range(model.worlds):
            alert = 0
            for agent in range(model.agents):
                alert |= get(state.alert, 0, world * model.agents + agent)
            # A test of the sum skips the loop in most worlds, and it is vectorized.
            if alert != 0:
                agent = step % model.agents
                for _ in range(model.agents):
                    eat_items(model, state, world, agent, step)
                    agent = agent + 1 if agent + 1 < model.agents else 0
            resort_stale_cells(model, state, world)


class _SingleAgent:
    """Hooks for one agent, when it is its turn."""

    lane_of = staticmethod(lane_of.default)

    @staticmethod
    def prepare_senses_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        prepare_all_senses(state.senses, model, state, agents.first_world, step)

    @staticmethod
    def observe_others_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        observe_others(state.rule, model, state, agents.first_world, step)

    @staticmethod
    def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
        eat_items(model, state, agents.first_world, agents.first_agent, step)
        resort_stale_cells(model, state, agents.first_world)


class AllAgents(NamedTuple):
    """All agents of a batch. The ends of the ranges are exclusive."""

    first: int
    last: int
    stride: int
    first_world: int
    last_world: int
    first_agent: int
    last_agent: int


class SingleAgent(NamedTuple):
    """One agent. The ends of the ranges are exclusive."""

    first: int
    last: int
    stride: int
    first_world: int
    last_world: int
    first_agent: int
    last_agent: int


AllAgents.part = _AllAgents  # type: ignore[attr-defined]
SingleAgent.part = _SingleAgent  # type: ignore[attr-defined]


@compiled
def all_agents(model: MiniWorldModel, state: State) -> AllAgents:
    """Return the range of all agents of a batch."""
    return AllAgents(
        0, state.positions.shape[1], lanes_in_block(), 0, model.worlds, 0, model.agents
    )


def simulate_simultaneous(
    model: MiniWorldModel, state: State, newborn: bool, first_step: int, last_step: int
) -> None:
    """Simulate the steps from `first_step` to `last_step` - 1, with all agents at the same time.

    If `newborn`, initialize the generation first.
    """
    model = as_pointer(model)
    state = as_pointer(state)
    if newborn:
        init_generation(model, state)
    agents = all_agents(model, state)
    for step in range(first_step, last_step):
        take_step(agents, model, state, step)
        for world in range(model.worlds):
            end_step_of_features(state.features, model, state, world, step)


def simulate_sequential(
    model: MiniWorldModel, state: State, newborn: bool, first_step: int, last_step: int
) -> None:
    """Simulate steps as `simulate_simultaneous`, but one agent after another (R7)."""
    model = as_pointer(model)
    state = as_pointer(state)
    if newborn:
        init_generation(model, state)
    for step in range(first_step, last_step):
        for world in range(model.worlds):
            agent = step % model.agents
            for _ in range(model.agents):
                lane = world * model.agents + agent
                take_step(
                    SingleAgent(lane, lane + 1, 1, world, world + 1, agent, agent + 1),
                    model,
                    state,
                    step,
                )
                agent = agent + 1 if agent + 1 < model.agents else 0
            end_step_of_features(state.features, model, state, world, step)
