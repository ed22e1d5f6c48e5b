"""The map: births, and what may get in the way on a torus.

Source: the paper, "The Simulated World of Foods and Agents"; docs/explanation/model.md for what the paper leaves open.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import for_each, select_by_type
from baldwinlab.engine.rng import BIRTHPLACE, HEADING, MOTOR, philox, unit
from baldwinlab.engine.simd import Lane, Mask, Value, choose, get, put
from baldwinlab.models.miniworld.state import HEADING_COUNT, Model, State
from baldwinlab.parts.agent_parts import blocks_movement, blocks_placement, move

ZERO, ONE, TWO, HALF = np.float32(0), np.float32(1), np.float32(2), np.float32(0.5)
HEADINGS = np.float32(HEADING_COUNT)
MAX_ATTEMPTS = 100_000  # that are tried, before somebody is born where it is forbidden


@compiled
def combine_masks(one: Mask, other: Mask) -> Mask:
    """Where any of two masks is true."""
    return one | other


is_placement_blocked = for_each(
    blocks_placement, False, combine_masks
)  # True if any feature blocks placement
is_movement_blocked = for_each(
    blocks_movement, False, combine_masks
)  # True if any feature blocks movement


@compiled
def wrap_position(position: Value, span: np.float32) -> Value:
    """`position`, at most one map's span outside of it, brought back into [0, span)."""
    position = choose(position < ZERO, position + span, position)
    return choose(position < span, position, position - span)


@compiled
def shortest_difference(difference: Value, span: np.float32) -> Value:
    """The difference of two positions on a circle of length `span`, the short way round."""
    half = span * HALF
    difference = choose(difference > half, difference - span, difference)
    return choose(difference < -half, difference + span, difference)


@compiled
def place_newborn(model: Model, state: State, world: int, agent: int, number: int) -> None:
    """Put a newborn at its birthplace, uniformly in the start disc, heading along +x, or anywhere: each number has its own."""
    seed, run = state.keys[world, 0], state.keys[world, 1]
    x, y, attempt = ONE, ONE, 0
    lane, searching = world * model.agents + agent, True
    while (
        searching
    ):  # of a square's points, the first that lies in the disc, and where no feature blocks it
        words = philox(attempt, number, state.generation[0], BIRTHPLACE, seed, run)
        x = TWO * unit(words[0]) - ONE
        y = TWO * unit(words[1]) - ONE
        attempt += 1
        state.positions[0, lane] = wrap_position(model.start[0] + model.start[2] * x, model.width)
        state.positions[1, lane] = wrap_position(model.start[1] + model.start[2] * y, model.height)
        taken = (
            is_placement_blocked(
                state.features, model, state.positions[0, lane], state.positions[1, lane]
            )
            and attempt < MAX_ATTEMPTS
        )
        searching = bool(x * x + y * y > ONE) or taken
    state.heading[0, lane] = ZERO
    if model.random_headings:
        words = philox(0, number, state.generation[0], HEADING, seed, run)
        state.heading[0, lane] = np.float32(int(HEADINGS * unit(words[0])))


@compiled
def apply_motor_noise(
    model: Model, state: State, world: int, lane: int, agent: int, step: int
) -> None:
    """Motor noise: now and then, another action than the chosen one, drawn at random of all there are."""
    words = philox(
        step, agent, state.generation[0], MOTOR, state.keys[world, 0], state.keys[world, 1]
    )
    if unit(words[0]) < model.action_noise:
        state.action[0, lane] = np.float32(int(np.float32(state.targets.shape[0]) * unit(words[1])))


@compiled
def _move_unless_blocked(features: Any, model: Model, state: State, lane: Lane) -> None:
    """Do the action. An agent whose way is blocked stays where it is."""
    old_x, old_y = get(state.positions, 0, lane), get(state.positions, 1, lane)
    move(state.body, model, state, lane)
    x, y = get(state.positions, 0, lane), get(state.positions, 1, lane)
    stopped = is_movement_blocked(features, model, x, y)
    put(state.positions, 0, lane, choose(stopped, old_x, x))
    put(state.positions, 1, lane, choose(stopped, old_y, y))


@compiled
def _move_freely(features: Any, model: Model, state: State, lane: Lane) -> None:
    """Do the action, where there is nothing that could stop anybody."""
    move(state.body, model, state, lane)


move_agents = select_by_type(_move_unless_blocked, _move_freely)
