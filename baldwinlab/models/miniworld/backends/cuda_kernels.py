"""Kernels for NVIDIA GPUs: the birth of a generation, and the steps of a lifetime.

A thread simulates an agent, and the agents of a world share a thread block.
One launch simulates all steps. The hooks and the order of a step (`step.py`) are those of the CPU,
compiled for a single lane.
The per-agent arrays of the step are local to the thread, so that the compiler can use registers.
They are global if a part reads other agents.
All other arrays are in global memory. Items change only between two barriers.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np
from numba import cuda, int32

from baldwinlab.engine.gpu import any_lane, device, kernel
from baldwinlab.engine.phases import make_part_type
from baldwinlab.models.miniworld.birth import init_agent_state, init_features
from baldwinlab.models.miniworld.items import (
    MAX_CONTACT_PER_REACH,
    find_cells_within,
    find_slots_in_row,
    is_touching,
    place_item,
    position_in_image,
    resort_stale_cells,
    sort_into_cells,
)
from baldwinlab.models.miniworld.learning.control import init_control
from baldwinlab.models.miniworld.lookup import fill_table
from baldwinlab.models.miniworld.map import place_newborn
from baldwinlab.models.miniworld.population import agent_number, eats_region
from baldwinlab.models.miniworld.state import ARRAYS, MiniWorldModel, State
from baldwinlab.models.miniworld.state_arrays import reads_other_agents
from baldwinlab.models.miniworld.step import (
    AGENT_RANGES,
    end_step_of_features,
    lane_of,
    observe_others_per_world,
    prepare_all_senses,
    prepare_senses_per_world,
    single_agent,
    take_step,
    wait_for_agents,
)
from baldwinlab.parts.learning_rules import init_agent, load_genes, observe_others
from baldwinlab.parts.world_features import end_step


@device
def _copy(source: Any, target: Any, lane: int) -> None:
    """Copy one lane of an array [row, lane] to the same lane of `target`."""
    for row in range(target.shape[0]):
        target[row, lane] = source[row, lane]


@device
def _contend_for_items(
    agents: Any, model: MiniWorldModel, state: State, step: int, claim: int, is_taking: bool
) -> bool:
    """Claim the items that the agent touches, or eat the items that it has claimed (`is_taking`).

    Two calls replace `eat_items` for all agents of a world at the same time: all agents claim, and
    after a barrier, all agents eat. The highest claim of an item wins.
    Return whether the agent touches any item.
    """
    has_touched = False
    world = agents.first_world
    lane = agents.first_lane
    is_alert = state.alert[0, lane] != 0
    for region in range(model.regions.shape[0] if is_alert else 0):
        is_eaten = eats_region(state.population, region)
        for number in range(model.images[region] if is_eaten else 0):
            x, y = position_in_image(
                model, region, number, state.positions[0, lane], state.positions[1, lane]
            )
            radius = MAX_CONTACT_PER_REACH * model.reach
            columns = find_cells_within(model, region, 0, x, radius)
            first_row, end_row = find_cells_within(model, region, 1, y, radius)
            for row in range(first_row, end_row):
                first_slot, end_slot = find_slots_in_row(model, state, world, region, row, columns)
                for slot in range(first_slot, end_slot):
                    if is_touching(model, state, world, slot, x, y):
                        has_touched = True
                        item = state.slot_item[world, slot]
                        if not is_taking:
                            cuda.atomic.max(agents.claims, (world, item), claim)
                        elif agents.claims[world, item] == claim:
                            # Claims are even. The odd value marks the item as taken.
                            agents.claims[world, item] = claim + 1
                            state.touched[world, item] = step
                            state.eaten_in_life[region, lane] += 1
                            place_item(model, state, world, region, item)
    return has_touched


@device
def _eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Let all agents of a batch eat. Items move only after all agents have claimed."""
    agent = agents.first_agent
    agents_in_world = model.agents
    turn = (agent + agents_in_world - step % agents_in_world) % agents_in_world
    # Claims of later steps are higher. In a step, claims of earlier turns are higher.
    claim = 2 * (step * agents_in_world + agents_in_world - 1 - turn)
    has_touched = _contend_for_items(agents, model, state, step, claim, False)
    # This barrier also tests whether any agent of the thread block touches an item.
    if cuda.syncthreads_or(int32(has_touched)) != 0:
        if has_touched:
            _contend_for_items(agents, model, state, step, claim, True)
        cuda.syncthreads()
        if agent == 0:
            resort_stale_cells(model, state, agents.first_world)
        cuda.syncthreads()


class _SingleAgentThread:
    """Hooks for agents that take a step at the same time, and are independent until they eat."""

    lane_of = staticmethod(lane_of.default)
    prepare_senses_per_world = staticmethod(prepare_senses_per_world.default)
    observe_others_per_world = staticmethod(observe_others_per_world.default)
    wait_for_agents = staticmethod(wait_for_agents.default)

    @staticmethod
    def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
        _eat_all(agents, model, state, step)


class _AgentInBlock(_SingleAgentThread):
    """Hooks for agents that take a step at the same time, if a part has a per-world hook."""

    @staticmethod
    def prepare_senses_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        if agents.first_agent == 0:
            prepare_all_senses(state.senses, model, state, agents.first_world, step)
        cuda.syncthreads()

    @staticmethod
    def observe_others_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        cuda.syncthreads()
        if agents.first_agent == 0:
            observe_others(state.rule, model, state, agents.first_world, step)
        cuda.syncthreads()

    @staticmethod
    def wait_for_agents(agents: Any) -> None:
        cuda.syncthreads()

    @staticmethod
    def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
        _eat_all(agents, model, state, step)
        cuda.syncthreads()
        if agents.first_agent == 0:
            resort_stale_cells(model, state, agents.first_world)
            end_step_of_features(state.features, model, state, agents.first_world, step)
            end_step_of_features(state.recorders, model, state, agents.first_world, step)
        cuda.syncthreads()


# `claims` is the highest claim of each item, [world, item].
SingleAgentThread = make_part_type(_SingleAgentThread, (*AGENT_RANGES, "claims"))
AgentInBlock = make_part_type(_AgentInBlock, (*AGENT_RANGES, "claims"))


def _make_simulation(agents_type: Any) -> Any:
    """Return the function that simulates the steps of an agent, with the hooks of `agents_type`."""

    @device
    def simulate(
        model: MiniWorldModel,
        state: State,
        claims: Any,
        world: int,
        agent: int,
        first_step: int,
        last_step: int,
    ) -> None:
        lane = world * model.agents + agent
        for step in range(first_step, last_step):
            agents = agents_type(
                first_lane=lane,
                end_lane=lane + 1,
                lanes_per_block=1,
                first_world=world,
                end_world=world + 1,
                first_agent=agent,
                end_agent=agent + 1,
                claims=claims,
            )
            take_step(agents, model, state, step)

    return simulate


# If no part has a per-world hook, and otherwise with barriers around such hooks.
_simulate_independent = _make_simulation(SingleAgentThread)
_simulate_in_block = _make_simulation(AgentInBlock)


@device
def _simulate_sequential(
    model: MiniWorldModel,
    state: State,
    claims: Any,
    world: int,
    agent: int,
    first_step: int,
    last_step: int,
) -> None:
    """Simulate the steps of an agent, which waits for its turn in each step (R7)."""
    for step in range(first_step, last_step):
        for turn in range(model.agents):
            if agent == (step + turn) % model.agents:
                take_step(single_agent(model, world, agent), model, state, step)
            cuda.syncthreads()
        if agent == 0:
            end_step_of_features(state.features, model, state, world, step)
            end_step_of_features(state.recorders, model, state, world, step)
        cuda.syncthreads()


@cache
def make_birth_kernel(threads: int) -> Any:
    """Return the kernel that initializes a generation. Each agent places some of the items."""

    @kernel(threads)
    def begin(model: MiniWorldModel, state: State, claims: Any) -> None:
        lane = cuda.grid(1)
        world = lane // model.agents
        agent = lane % model.agents
        init_agent_state(model, state, world, agent)
        if agent == 0:
            init_features(state.features, model, state, world)
        cuda.syncthreads()
        place_newborn(model, state, world, agent, agent_number(state.population, agent))
        load_genes(state.rule, model, state, state.genes, lane)
        init_agent(state.rule, model, state, world, agent)
        init_control(state.control, model, state, world, agent)
        for region in range(model.regions.shape[0]):
            for item in range(
                model.region_items[region] + agent, model.region_items[region + 1], model.agents
            ):
                claims[world, item] = -1
                state.touched[world, item] = -1
                state.appearances[world, item] = 0
                place_item(model, state, world, region, item)
        cuda.syncthreads()
        for region in range(agent, model.regions.shape[0], model.agents):
            sort_into_cells(model, state, world, region)
        fill_table(state.lookup, model, state, state.genes, lane)

    return begin


_KERNEL_SOURCE = """
def make(Network, any_lane):
    {constants}
    def simulate(shared, state, claims, first_step, last_step):
        lane = cuda.grid(1)
        world = lane // shared.agents
        agent = lane % shared.agents
        {arrays}
        model = MiniWorldModel({model})
        local_state = State({state})
        {copies_in}
        {function}(model, local_state, claims, world, agent, first_step, last_step)
        {copies_out}
    return simulate
"""


def make_kernel_source(model: MiniWorldModel, state: State, sequential: bool) -> str:
    """Return the source of the kernel that simulates steps.

    Constants are literals, so that the compiler can unroll loops and remove branches.
    """
    needs_barriers = _needs_barriers(state)
    local_names = [name for name, array in ARRAYS.items() if array.owner == "agent"]
    local_arrays = {} if needs_barriers else {name: getattr(state, name) for name in local_names}
    derived = type(state.network).part.derived
    network_fields = {
        name: f"network_{name}" if name in derived else f"state.network.{name}"
        for name in state.network._fields
    }
    local_state = {
        name: f"any_lane({name}, state.{name}.shape[1])"
        if name in local_arrays
        else f"state.{name}"
        for name in State._fields
    }
    # A network without fields needs no new tuple.
    if network_fields:
        local_state["network"] = f"Network({_arguments(network_fields)})"
    return _KERNEL_SOURCE.format(
        constants=_lines(
            f"network_{name} = {_constant(getattr(state.network, name))}" for name in derived
        ),
        arrays=_lines(
            f"{name} = cuda.local.array(({array.shape[0]}, 1), np.{array.dtype})"
            for name, array in local_arrays.items()
        ),
        model=_arguments(
            {name: f"shared.{name}" for name in MiniWorldModel._fields}
            | {"inputs": str(model.inputs)}
        ),
        state=_arguments(local_state),
        copies_in=_lines(f"_copy(state.{name}, local_state.{name}, lane)" for name in local_arrays),
        copies_out=_lines(
            f"_copy(local_state.{name}, state.{name}, lane)" for name in local_arrays
        ),
        function=_step_function(sequential, needs_barriers),
    )


def _step_function(sequential: bool, needs_barriers: bool) -> str:
    """Return the name of the function that simulates steps."""
    if sequential:
        return "_simulate_sequential"
    return "_simulate_in_block" if needs_barriers else "_simulate_independent"


def _needs_barriers(state: State) -> bool:
    """Return whether any part reads other agents in a step, for example in a per-world hook."""
    features = [type(feature).part for feature in (*state.features, *state.recorders)]
    return reads_other_agents(state) or any(
        feature.end_step is not end_step.default for feature in features
    )


def _lines(statements: Iterable[str]) -> str:
    """Return statements as one line of source."""
    return "; ".join(statements) or "pass"


def _arguments(values: dict[str, str]) -> str:
    """Return keyword arguments as source."""
    return ", ".join(f"{name}={value}" for name, value in values.items())


def _constant(value: Any) -> str:
    """Return the source of a number or an array."""
    return (
        f"np.array({value.tolist()!r}, np.{value.dtype})"
        if isinstance(value, np.ndarray)
        else repr(value)
    )


@cache
def make_simulation_kernel(threads: int, source: str, network: Any) -> Any:
    """Return the kernel of a source, for a network part."""
    namespace: dict[str, Any] = {}
    # The source uses the names of this module, because the GPU simulator replaces `cuda` here.
    exec(source, globals(), namespace)
    return kernel(threads)(namespace["make"](network.Compiled, any_lane))
