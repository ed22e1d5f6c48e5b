"""Kernels for NVIDIA GPUs: the birth of a generation, and the steps of a lifetime.

`cuda.py` compiles and launches these kernels. A thread simulates one agent. All agents of a world
are in one thread block, because a barrier can wait only for the threads of a block. One launch
simulates a range of steps. The threads call `take_step` (`step.py`), as the CPU does, but the
function is compiled for one lane (one agent, a column of the arrays) instead of a SIMD block.

A thread copies one column of the per-agent arrays of `State` to local memory at the start of a
launch, and back at the end, because the compiler can hold local memory in registers. If a part
reads other agents, these arrays remain in global memory, as all other arrays do. The positions of
items change only between two barriers.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any, Final

import numpy as np
from numba import cuda, int32

from baldwinlab.engine.gpu import any_lane, device, kernel
from baldwinlab.engine.phases import hook_functions, make_part_type
from baldwinlab.models.miniworld.allocation import reads_other_agents
from baldwinlab.models.miniworld.birth import init_agent_state, init_features
from baldwinlab.models.miniworld.items import (
    contend,
    init_item,
    resort_stale_cells,
    sort_into_cells,
)
from baldwinlab.models.miniworld.learning.control import init_control
from baldwinlab.models.miniworld.lookup import fill_table
from baldwinlab.models.miniworld.map import place_newborn
from baldwinlab.models.miniworld.population import agent_number
from baldwinlab.models.miniworld.state import ARRAYS, MiniWorldModel, State
from baldwinlab.models.miniworld.step import (
    CONTENDING_AGENTS,
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
def _eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Let the agent of this thread eat. All threads of the block call the function together.

    An eaten item moves only after all agents of the block have claimed the items that they touch.
    """
    agent = agents.first_agent
    is_alert = state.alert[0, agents.first_lane] != 0
    # With `is_eating` = False, `contend` only claims items. With True, the agent eats them.
    has_touched = is_alert and contend(agents, model, state, agent, step, False)
    # This barrier returns to all threads of the block whether any agent touches an item.
    if cuda.syncthreads_or(int32(has_touched)) != 0:
        if has_touched:
            contend(agents, model, state, agent, step, True)
        cuda.syncthreads()
        if agent == 0:
            resort_stale_cells(model, state, agents.first_world)
        cuda.syncthreads()


class _SingleAgentThread:
    """Hooks for one agent per thread, if no part reads other agents. Only eating has barriers."""

    lane_of = staticmethod(lane_of.default)
    prepare_senses_per_world = staticmethod(prepare_senses_per_world.default)
    observe_others_per_world = staticmethod(observe_others_per_world.default)
    wait_for_agents = staticmethod(wait_for_agents.default)

    @staticmethod
    def raise_claim(agents: Any, world: int, item: int, claim: int) -> None:
        cuda.atomic.max(agents.claims, (world, item), claim)

    @staticmethod
    def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
        _eat_all(agents, model, state, step)


class _AgentInBlock(_SingleAgentThread):
    """Hooks for one agent per thread, if a part reads other agents.

    The thread of agent 0 calls the hooks per world, between barriers.
    """

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
            # `_eat_all` sorts only if an agent touches an item. This call sorts a region that a
            # feature has changed without sorting. The CPU also sorts in every step.
            resort_stale_cells(model, state, agents.first_world)
            end_step_of_features(state.features, model, state, agents.first_world, step)
            end_step_of_features(state.recorders, model, state, agents.first_world, step)
        cuda.syncthreads()


SingleAgentThread = make_part_type(_SingleAgentThread, CONTENDING_AGENTS)
AgentInBlock = make_part_type(_AgentInBlock, CONTENDING_AGENTS)
AGENT_HOOKS: Final = (*hook_functions(_SingleAgentThread), *hook_functions(_AgentInBlock))
"""The hooks of this module, which the kernels call by the type of the agents."""


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


# The first function is for experiments in which no part reads other agents. The second function has
# barriers around the per-world hooks.
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
    """Simulate the steps of an agent, one agent of a world after another (interpretation R7)."""
    for step in range(first_step, last_step):
        for turn in range(model.agents):
            # Agent `step % model.agents` is the first. The other threads wait at the barrier.
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
                init_item(claims, model, state, world, region, item)
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
    """Return the source of the kernel that simulates steps, from the template `_KERNEL_SOURCE`.

    The source has the number of inputs and the derived values of the network as literals, so that
    the compiler can unroll loops and remove branches. Other values are arguments of the kernel.
    """
    needs_barriers = _needs_barriers(state)
    local_names = [name for name, array in ARRAYS.items() if array.owner == "agent"]
    local_arrays = {} if needs_barriers else {name: getattr(state, name) for name in local_names}
    derived = type(state.network).part.derived
    network_fields = {
        name: f"network_{name}" if name in derived else f"state.network.{name}"
        for name in state.network._fields
    }
    # A local array has one column. `any_lane` returns this column for every lane, because the step
    # uses the lane of the agent in the batch.
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
    """Return the name of the function of this module that the source calls."""
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
    """Return the source of a number or an array, such as "np.array([3, 5, 3], np.int64)"."""
    return (
        f"np.array({value.tolist()!r}, np.{value.dtype})"
        if isinstance(value, np.ndarray)
        else repr(value)
    )


@cache
def make_simulation_kernel(threads: int, source: str, network: Any) -> Any:
    """Compile a source of `make_kernel_source`. `network` is the class of the network part."""
    namespace: dict[str, Any] = {}
    # The source needs the globals of this module, for example `State`. The GPU simulator replaces
    # the global `cuda` while a kernel runs.
    exec(source, globals(), namespace)
    return kernel(threads)(namespace["make"](network.Compiled, any_lane))
