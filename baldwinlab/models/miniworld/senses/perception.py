"""Perception: the agents that sense in a step, and the inputs of the networks.

An agent far from all items senses in no step, unless a sense depends on more than items.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.phases import part_class, select_by_type
from baldwinlab.engine.simd import HALF, ONE, ZERO, Lane, choose, get, put
from baldwinlab.models.miniworld.items import nearest_image
from baldwinlab.models.miniworld.lookup import look_up_outputs
from baldwinlab.models.miniworld.map import shortest_difference
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.senses import count_inputs, measure, sense


@compiled
def mark_agents_near_regions(model: MiniWorldModel, state: State, lane: Lane) -> None:
    """Set `near` of the agents near any region of items."""
    # An agent that was near in the last step senses once more, which clears the inputs.
    was_near = get(state.near, 0, lane) > HALF
    put(state.near, 0, lane, choose(was_near, HALF, model.minimum_near))
    # One unit of length more than the radius covers rounding.
    reach = max(model.visual_radius, model.alert_radius) + ONE
    for region in range(model.regions.shape[0]):
        half_width = model.regions[region, 1] * HALF
        half_height = model.regions[region, 3] * HALF
        center_x = model.regions[region, 0] + half_width
        center_y = model.regions[region, 2] + half_height
        x = get(state.positions, 0, lane)
        y = get(state.positions, 1, lane)
        put(state.image_x, region, lane, nearest_image(x, center_x, model.width))
        put(state.image_y, region, lane, nearest_image(y, center_y, model.height))
        dx = shortest_difference(x - center_x, model.width)
        dy = shortest_difference(y - center_y, model.height)
        is_near = (abs(dx) <= half_width + reach) & (abs(dy) <= half_height + reach)
        put(state.near, 0, lane, choose(is_near, ONE, get(state.near, 0, lane)))


def _sense_all(senses: Any, model: Any, state: Any, world: int, agent: int) -> int:
    """Return the bits of all senses. The first sense has the lowest bits."""
    code = 0
    first_bit = 0
    for sense_part in senses:
        code |= sense(sense_part, model, state, world, agent) << first_bit
        first_bit += count_inputs(sense_part)
    return code


def _choose_sense_all(senses: Any, model: Any, state: Any, world: Any, agent: Any) -> Any:
    """Return the compiled form of `_sense_all`, with one call per sense."""
    if len(senses) == 1:
        return lambda senses, model, state, world, agent: sense(
            senses[0], model, state, world, agent
        )
    return lambda senses, model, state, world, agent: (
        sense(senses[0], model, state, world, agent)
        | (sense_all(senses[1:], model, state, world, agent) << count_inputs(senses[0]))
    )


sense_all = register(_sense_all, _choose_sense_all)


@compiled
def _write_bits(
    sense_part: Any, model: Any, state: Any, world: int, agent: int, first_row: int
) -> None:
    """Set the inputs of a binary sense, from `first_row` on."""
    code = sense(sense_part, model, state, world, agent)
    for k in range(count_inputs(sense_part)):
        state.activations[first_row + k, world * model.agents + agent] = np.float32((code >> k) & 1)


def _write_inputs(
    senses: Any, model: Any, state: Any, world: int, agent: int, first_row: int
) -> None:
    """Set the inputs of an agent from `first_row` on."""
    for sense_part in senses:
        if type(sense_part).part.is_continuous:
            measure(sense_part, model, state, world, agent)
        else:
            _write_bits(sense_part, model, state, world, agent, first_row)
        first_row += count_inputs(sense_part)


def _choose_write_inputs(
    senses: Any, model: Any, state: Any, world: Any, agent: Any, first_row: Any
) -> Any:
    """Return the compiled form of `_write_inputs`, with one call per sense."""
    if len(senses) == 0:
        return lambda senses, model, state, world, agent, first_row: None
    is_continuous = part_class(senses[0]).is_continuous

    def write(senses: Any, model: Any, state: Any, world: int, agent: int, first_row: int) -> None:
        if is_continuous:
            measure(senses[0], model, state, world, agent)
        else:
            _write_bits(senses[0], model, state, world, agent, first_row)
        write_inputs(senses[1:], model, state, world, agent, first_row + count_inputs(senses[0]))

    return write


write_inputs = register(_write_inputs, _choose_write_inputs)


@compiled
def _set_continuous_inputs(
    senses: Any, model: MiniWorldModel, state: State, world: int, agent: int
) -> None:
    """Set the inputs of an agent, if any input is real-valued. The code of the inputs is 0."""
    write_inputs(senses, model, state, world, agent, 0)
    state.code[0, world * model.agents + agent] = 0


@compiled
def _set_binary_inputs(
    senses: Any, model: MiniWorldModel, state: State, world: int, agent: int
) -> None:
    """Set the binary inputs of an agent, and look up the outputs for these inputs.

    Unchanged inputs are also written, because a mispredicted branch takes longer than the write.
    """
    lane = world * model.agents + agent
    code = sense_all(senses, model, state, world, agent)
    put(state.code, 0, lane, code)
    for k in range(model.inputs):
        put(state.activations, k, lane, np.float32(code & 1))
        code >>= 1
    look_up_outputs(state.lookup, model, state, lane)


_set_inputs = select_by_type(
    _set_continuous_inputs, _set_binary_inputs, lambda part: bool(part.is_continuous)
)


@compiled
def list_near_agents(
    model: MiniWorldModel, state: State, world: int, first_agent: int, end_agent: int
) -> int:
    """List the agents with `near` above 0 in `near_agents`, and return the length of the list.

    Only agents `first_agent` to `end_agent` - 1 are listed. Every agent is written, and the next
    agent overwrites an agent that is not near, because branches would often be mispredicted.
    """
    n_near = 0
    first_lane = world * model.agents
    for agent in range(first_agent, end_agent):
        put(state.near_agents, 0, first_lane + first_agent + n_near, agent)
        n_near += int(get(state.near, 0, first_lane + agent) != ZERO)
    return n_near


@compiled
def perceive(model: MiniWorldModel, state: State, world: int, agent: int) -> None:
    """Call the senses of an agent, which set the inputs and `state.alert`."""
    lane = world * model.agents + agent
    put(state.alert, 0, lane, model.minimum_alert)
    _set_inputs(state.senses, model, state, world, agent)
