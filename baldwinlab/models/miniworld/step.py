"""One time step: the phases of Le (2019), in the same order. All backends use this code.

A lifetime is a pure function of the experiment, the seed, the run, the generation and the genomes.

The type of the argument `agents` selects the agents that take a step:

- `AllAgents`: all agents of a batch, one SIMD block at a time, phase by phase.
- `SingleAgent`: one agent, for the sequential update (interpretation R7).
- A backend can add types that contain barriers, for example in `cuda_kernels.py`.
"""

from __future__ import annotations

from typing import Any, Final

from baldwinlab.engine.elements import for_element
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import for_each_part, hook, make_part_type
from baldwinlab.engine.reference import as_pointer
from baldwinlab.engine.simd import ZERO, Lane, get, lanes_in_block, simd_block
from baldwinlab.models.miniworld.birth import init_generation
from baldwinlab.models.miniworld.items import eat_items, resort_stale_cells
from baldwinlab.models.miniworld.learning.control import (
    exchange_changes,
    load_shadow,
    store_shadow,
)
from baldwinlab.models.miniworld.lookup import compute_outputs
from baldwinlab.models.miniworld.map import apply_motor_noise
from baldwinlab.models.miniworld.population import (
    agent_number,
    count_step,
    exclude_dead,
    has_learners,
    learn_living,
    move_living,
)
from baldwinlab.models.miniworld.senses.perception import (
    list_near_agents,
    mark_agents_near_regions,
    perceive,
)
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.bodies import choose_action
from baldwinlab.parts.learning_rules import observe_others
from baldwinlab.parts.senses import prepare_senses
from baldwinlab.parts.world_features import end_step

# Fields of `agents`: ranges of lanes, worlds and agents. The end of a range is exclusive.
AGENT_RANGES: Final = (
    "first_lane",
    "end_lane",
    "lanes_per_block",
    "first_world",
    "end_world",
    "first_agent",
    "end_agent",
)
# Fields of `agents` that eat at the same time (`contend`). `claims` [world, item] is the highest
# claim of each item. An odd claim means that the item was eaten.
CONTENDING_AGENTS: Final = (*AGENT_RANGES, "claims")

end_step_of_features = for_each_part(end_step)
prepare_all_senses = for_each_part(prepare_senses)


@hook
def lane_of(agents: Any, first: int) -> Lane:
    """Return the lane `first`, or the SIMD block that starts at this lane."""
    return first


@hook
def prepare_senses_per_world(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Per world: call `prepare_senses` of all senses, before any agent senses."""


@hook
def observe_others_per_world(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Per world: call `observe_others` of the learning rule, after all actions."""


@hook
def wait_for_agents(agents: Any) -> None:
    """Wait until all agents of the world have learned, if several threads simulate the world."""


@hook
def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Let the agents eat. The order of the step decides which agent gets a touched item."""


@compiled
def take_step(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Sense, compute the outputs, act, learn and eat."""
    sense_environment(agents, model, state, step)
    for first in range(agents.first_lane, agents.end_lane, agents.lanes_per_block):
        compute_outputs(state.lookup, model, state, lane_of(agents, first))
    act_and_learn(agents, model, state, step)


@compiled
def sense_environment(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Set the inputs of the agents. `state.near_agents` lists the agents that sense."""
    for first in range(agents.first_lane, agents.end_lane, agents.lanes_per_block):
        mark_agents_near_regions(model, state, lane_of(agents, first))
        exclude_dead(state.population, state, lane_of(agents, first))
    prepare_senses_per_world(agents, model, state, step)
    for world in range(agents.first_world, agents.end_world):
        first_entry = world * model.agents + agents.first_agent
        near_agents = list_near_agents(model, state, world, agents.first_agent, agents.end_agent)
        for entry in range(first_entry, first_entry + near_agents):
            perceive(model, state, world, get(state.near_agents, 0, entry))


@compiled
def act_and_learn(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Act on the outputs, then learn and eat."""
    act(agents, model, state, step)
    learn_from_step(agents, model, state, step)
    eat_all(agents, model, state, step)


@compiled
def act(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Choose the actions from the outputs, and move."""
    for first in range(agents.first_lane, agents.end_lane, agents.lanes_per_block):
        choose_action(state.body, model, state, lane_of(agents, first))
    if model.action_noise > ZERO:
        for world in range(agents.first_world, agents.end_world):
            for agent in range(agents.first_agent, agents.end_agent):
                number = agent_number(state.population, agent)
                apply_motor_noise(model, state, world, world * model.agents + agent, number, step)
    for first in range(agents.first_lane, agents.end_lane, agents.lanes_per_block):
        move_living(state.population, model, state, lane_of(agents, first))
        count_step(state.population, state, lane_of(agents, first))


@compiled
def learn_from_step(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Observe other agents, and learn."""
    is_learning = has_learners(state.population, model, step)
    if is_learning:
        # The hooks of the rule, such as `observe_others`, read the weights of the shadow.
        for first in range(agents.first_lane, agents.end_lane, agents.lanes_per_block):
            load_shadow(state.control, model, state, lane_of(agents, first))
    observe_others_per_world(agents, model, state, step)
    if is_learning:
        for first in range(agents.first_lane, agents.end_lane, agents.lanes_per_block):
            learn_living(state.population, model, state, step, lane_of(agents, first))
            store_shadow(state.control, model, state, lane_of(agents, first))
        wait_for_agents(agents)
        exchange_changes(state.control, agents, model, state)


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

    wait_for_agents = staticmethod(wait_for_agents.default)

    @staticmethod
    def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
        for world in range(model.worlds):
            # In most worlds no agent is near an item. This test is vectorized, and skips eating.
            any_alert = 0
            for agent in range(model.agents):
                any_alert |= get(state.alert, 0, world * model.agents + agent)
            if any_alert != 0:
                # In each step, another agent is the first to eat. Agent 0 follows the last agent.
                agent = step % model.agents
                for _ in range(model.agents):
                    eat_items(model, state, world, agent, step)
                    agent = agent + 1 if agent + 1 < model.agents else 0
            resort_stale_cells(model, state, world)


class _SingleAgent:
    """Hooks for one agent at a time."""

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

    wait_for_agents = staticmethod(wait_for_agents.default)

    @staticmethod
    def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
        eat_items(model, state, agents.first_world, agents.first_agent, step)
        resort_stale_cells(model, state, agents.first_world)


AllAgents = make_part_type(_AllAgents, AGENT_RANGES)
SingleAgent = make_part_type(_SingleAgent, AGENT_RANGES)


@compiled
def all_agents(model: MiniWorldModel, state: State) -> Any:
    """Return the ranges of all agents of a batch, and of the unused lanes after the last agent."""
    return AllAgents(
        first_lane=0,
        end_lane=state.positions.shape[1],
        lanes_per_block=lanes_in_block(),
        first_world=0,
        end_world=model.worlds,
        first_agent=0,
        end_agent=model.agents,
    )


@compiled
def single_agent(model: MiniWorldModel, world: int, agent: int) -> Any:
    """Return the ranges of one agent."""
    lane = world * model.agents + agent
    return SingleAgent(
        first_lane=lane,
        end_lane=lane + 1,
        lanes_per_block=1,
        first_world=world,
        end_world=world + 1,
        first_agent=agent,
        end_agent=agent + 1,
    )


@compiled
def simulate_simultaneous(
    model: MiniWorldModel, state: State, is_start: bool, first_step: int, last_step: int
) -> None:
    """Simulate the steps from `first_step` to `last_step` - 1, with all agents at the same time.

    If `is_start`, initialize the generation first.
    """
    model = as_pointer(model)
    state = as_pointer(state)
    if is_start:
        init_generation(model, state)
    agents = all_agents(model, state)
    for step in range(first_step, last_step):
        take_step(agents, model, state, step)
        for world in range(model.worlds):
            end_step_of_features(state.features, model, state, world, step)
            end_step_of_features(state.recorders, model, state, world, step)


@compiled
def simulate_sequential(
    model: MiniWorldModel, state: State, is_start: bool, first_step: int, last_step: int
) -> None:
    """Simulate steps as `simulate_simultaneous`, but one agent after another (interpretation R7).

    Agent `step % model.agents` is the first agent of a step.
    """
    model = as_pointer(model)
    state = as_pointer(state)
    if is_start:
        init_generation(model, state)
    for step in range(first_step, last_step):
        for world in range(model.worlds):
            agent = step % model.agents
            for _ in range(model.agents):
                take_step(single_agent(model, world, agent), model, state, step)
                agent = agent + 1 if agent + 1 < model.agents else 0
            end_step_of_features(state.features, model, state, world, step)
            end_step_of_features(state.recorders, model, state, world, step)


_simulate_simultaneous_block = for_element(simulate_simultaneous)
_simulate_sequential_block = for_element(simulate_sequential)


def simulate_simultaneous_blocks(
    model: MiniWorldModel,
    states: State,
    is_start: bool,
    first_step: int,
    last_step: int,
    first_block: int,
    end_block: int,
) -> None:
    """Simulate steps of a range of blocks of worlds, see `simulate_simultaneous`.

    The arrays of `states` have the first dimension `block`.
    """
    for block in range(first_block, end_block):
        _simulate_simultaneous_block(model, states, block, is_start, first_step, last_step)


def simulate_sequential_blocks(
    model: MiniWorldModel,
    states: State,
    is_start: bool,
    first_step: int,
    last_step: int,
    first_block: int,
    end_block: int,
) -> None:
    """Simulate steps of a range of blocks of worlds, see `simulate_simultaneous_blocks`."""
    for block in range(first_block, end_block):
        _simulate_sequential_block(model, states, block, is_start, first_step, last_step)
