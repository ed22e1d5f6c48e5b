"""What an NVIDIA GPU runs: the birth of a generation, and its life.

A thread is an agent; the agents of a world share a thread block, and all steps are one launch. The hooks are the CPU's own
functions, and so is the order of a step (life.py): they are compiled again for a single lane. What the step itself has of an
agent (weights, activations, place) is local to its thread, where the compiler may keep it in registers, unless a part looks at
others. All else stays in global memory; the items change only between two barriers.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import cuda, int32

from baldwinlab.engine.gpu import any_lane, device, kernel
from baldwinlab.models.miniworld.birth import init_agent_state, init_features
from baldwinlab.models.miniworld.items import (
    DIAGONAL,
    find_cells_within,
    find_slots_in_row,
    is_touching,
    place_item,
    position_in_image,
    resort_stale_cells,
    sort_into_cells,
)
from baldwinlab.models.miniworld.lookup import fill_table
from baldwinlab.models.miniworld.map import place_newborn
from baldwinlab.models.miniworld.state import ARRAYS, Model, State
from baldwinlab.models.miniworld.step import (
    SingleAgent,
    end_step_of_features,
    lane_of,
    observe_others_per_world,
    prepare_all_senses,
    prepare_senses_per_world,
    take_step,
)
from baldwinlab.parts.agent_parts import (
    end_step,
    init_agent,
    load_genes,
    observe_others,
    prepare_senses,
)


@device
def _copy(rows: Any, target: Any, lane: int) -> None:
    """Copy one lane of an array [row, lane] to the same lane of another."""
    for row in range(target.shape[0]):
        target[row, lane] = rows[row, lane]


@device
def _contend_for_items(
    who: Any, model: Model, state: State, step: int, claim: int, taking: bool
) -> bool:
    """Claim every item that the agent touches, or take those where no claim was higher. Returns whether any was touched.

    The same as `eat`, for all agents of a world at once: first they all claim, then, after a barrier, they all take.
    """
    found, world, lane = False, who.first_world, who.first
    for region in range(model.regions.shape[0] if state.alert[0, lane] != 0 else 0):
        for number in range(model.images[region]):
            x, y = position_in_image(
                model, region, number, state.positions[0, lane], state.positions[1, lane]
            )
            columns = find_cells_within(model, region, 0, x, DIAGONAL * model.reach)
            first_row, last_row = find_cells_within(model, region, 1, y, DIAGONAL * model.reach)
            for row in range(first_row, last_row):
                begin, end = find_slots_in_row(model, state, world, region, row, columns)
                for slot in range(begin, end):
                    if is_touching(model, state, world, slot, x, y):
                        found = True
                        item = state.slot_item[world, slot]
                        if not taking:
                            cuda.atomic.max(who.claims, (world, item), claim)
                        elif who.claims[world, item] == claim:
                            who.claims[world, item] = (
                                claim + 1
                            )  # no claim is odd: nobody takes it a second time
                            state.touched[world, item] = step
                            state.eaten_in_life[region, lane] += 1
                            place_item(model, state, world, region, item)
    return found


@device
def _eat_all(who: Any, model: Model, state: State, step: int) -> None:
    """All eat. Items stay where they are until all of the batch's agents have come to claim."""
    agent, agents = who.first_agent, model.agents
    turn = (agent + agents - step % agents) % agents
    claim = 2 * (
        step * agents + agents - 1 - turn
    )  # later steps outbid earlier ones, earlier turns later ones
    found = _contend_for_items(who, model, state, step, claim, False)
    if cuda.syncthreads_or(int32(found)) != 0:
        if found:
            _contend_for_items(who, model, state, step, claim, True)
        cuda.syncthreads()
        if agent == 0:
            resort_stale_cells(model, state, who.first_world)
        cuda.syncthreads()


class _SingleAgentThread:
    """One of the agents that take a step at the same time, each by itself until they eat."""

    lane_of = staticmethod(lane_of.default)
    prepare_senses_per_world = staticmethod(prepare_senses_per_world.default)
    observe_others_per_world = staticmethod(observe_others_per_world.default)

    @staticmethod
    def eat_all(who: Any, model: Model, state: State, step: int) -> None:
        _eat_all(who, model, state, step)


class _AgentInBlock(_SingleAgentThread):
    """One of the agents that take a step at the same time, in a world in which some part looks at all of them."""

    @staticmethod
    def prepare_senses_per_world(who: Any, model: Model, state: State, step: int) -> None:
        if who.first_agent == 0:
            prepare_all_senses(state.senses, model, state, who.first_world, step)
        cuda.syncthreads()

    @staticmethod
    def observe_others_per_world(who: Any, model: Model, state: State, step: int) -> None:
        cuda.syncthreads()
        if who.first_agent == 0:
            observe_others(state.rule, model, state, who.first_world, step)
        cuda.syncthreads()

    @staticmethod
    def eat_all(who: Any, model: Model, state: State, step: int) -> None:
        _eat_all(who, model, state, step)
        cuda.syncthreads()
        if who.first_agent == 0:
            resort_stale_cells(model, state, who.first_world)
            end_step_of_features(state.features, model, state, who.first_world, step)
        cuda.syncthreads()


class SingleAgentThread(NamedTuple):
    first: int
    last: int
    stride: int
    first_world: int
    last_world: int
    first_agent: int
    last_agent: int
    claims: Any  # [world, item], the highest claim to it so far


class AgentInBlock(NamedTuple):
    first: int
    last: int
    stride: int
    first_world: int
    last_world: int
    first_agent: int
    last_agent: int
    claims: Any


SingleAgentThread.part, AgentInBlock.part = _SingleAgentThread, _AgentInBlock  # type: ignore[attr-defined]


@device
def _simulate_independent(
    model: Model, state: State, claims: Any, world: int, agent: int, first_step: int, last_step: int
) -> None:
    lane = world * model.agents + agent
    for step in range(first_step, last_step):
        take_step(
            SingleAgentThread(lane, lane + 1, 1, world, world + 1, agent, agent + 1, claims),
            model,
            state,
            step,
        )


@device
def _simulate_in_block(
    model: Model, state: State, claims: Any, world: int, agent: int, first_step: int, last_step: int
) -> None:
    lane = world * model.agents + agent
    for step in range(first_step, last_step):
        take_step(
            AgentInBlock(lane, lane + 1, 1, world, world + 1, agent, agent + 1, claims),
            model,
            state,
            step,
        )


@device
def _simulate_sequential(
    model: Model, state: State, claims: Any, world: int, agent: int, first_step: int, last_step: int
) -> None:
    """Agent after agent, in the step's order, each finds what the last one left (R7)."""
    lane = world * model.agents + agent
    for step in range(first_step, last_step):
        for turn in range(model.agents):
            if agent == (step + turn) % model.agents:
                take_step(
                    SingleAgent(lane, lane + 1, 1, world, world + 1, agent, agent + 1),
                    model,
                    state,
                    step,
                )
            cuda.syncthreads()
        if agent == 0:
            end_step_of_features(state.features, model, state, world, step)
        cuda.syncthreads()


@cache
def make_birth_kernel(threads: int) -> Any:
    """The kernel in which a generation is born: the agents of a world share the work of placing its items."""

    @kernel(threads)
    def begin(model: Model, state: State, claims: Any) -> None:
        lane = cuda.grid(1)
        world, agent = lane // model.agents, lane % model.agents
        init_agent_state(model, state, world, agent)
        if agent == 0:
            init_features(state.features, model, state, world)
        cuda.syncthreads()
        place_newborn(model, state, world, agent, agent)
        load_genes(state.rule, model, state, state.genes, lane)
        init_agent(state.rule, model, state, world, agent)
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
    def live(shared, state, claims, first_step, last_step):
        lane = cuda.grid(1)
        world, agent = lane // shared.agents, lane % shared.agents
        {arrays}
        model = Model({model})
        mine = State({state})
        {copies_in}
        {live}(model, mine, claims, world, agent, first_step, last_step)
        {copies_out}
    return live
"""


def make_kernel_source(model: Model, state: State, sequential: bool) -> str:
    """The source of a kernel in which a generation lives: what is constant in it, the compiler can unroll or leave out."""
    together = _needs_barriers(state)
    own = (
        {}
        if together
        else {
            name: getattr(state, name) for name, array in ARRAYS.items() if array.owner == "agent"
        }
    )
    derived = type(state.network).part.derived
    network = {
        name: f"network_{name}" if name in derived else f"state.network.{name}"
        for name in state.network._fields
    }
    mine = {
        name: f"any_lane({name}, state.{name}.shape[1])" if name in own else f"state.{name}"
        for name in State._fields
    }
    if network:
        mine["network"] = f"Network({_arguments(network)})"
    return _KERNEL_SOURCE.format(
        constants=_lines(
            f"network_{name} = {_constant(getattr(state.network, name))}" for name in derived
        ),
        arrays=_lines(
            f"{name} = cuda.local.array(({a.shape[0]}, 1), np.{a.dtype})" for name, a in own.items()
        ),
        model=_arguments(
            {name: f"shared.{name}" for name in Model._fields} | {"inputs": str(model.inputs)}
        ),
        state=_arguments(mine),
        copies_in=_lines(f"_copy(state.{name}, mine.{name}, lane)" for name in own),
        copies_out=_lines(f"_copy(mine.{name}, state.{name}, lane)" for name in own),
        live="_simulate_sequential"
        if sequential
        else "_simulate_in_block"
        if together
        else "_simulate_independent",
    )


def _needs_barriers(state: State) -> bool:
    """Whether any part has a per-world hook in a step."""
    surveys = any(
        type(sense).part.prepare_senses is not prepare_senses.default for sense in state.senses
    )
    advances = any(
        type(feature).part.end_step is not end_step.default for feature in state.features
    )
    return surveys or advances or type(state.rule).part.observe_others is not observe_others.default


def _lines(statements: Iterable[str]) -> str:
    return "; ".join(statements) or "pass"


def _arguments(values: dict[str, str]) -> str:
    return ", ".join(f"{name}={value}" for name, value in values.items())


def _constant(value: Any) -> str:
    """The source of a number or an array."""
    return (
        f"np.array({value.tolist()!r}, np.{value.dtype})"
        if isinstance(value, np.ndarray)
        else repr(value)
    )


@cache
def make_simulation_kernel(threads: int, source: str, network: Any) -> Any:
    """The kernel of that source, for a network, which is a kind of part."""
    made: dict[str, Any] = {}
    exec(
        source, globals(), made
    )  # with this module's names: the simulator puts its own `cuda` there
    return kernel(threads)(made["make"](network.Compiled, any_lane))
