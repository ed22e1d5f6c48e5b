"""Positions on the map: birthplaces, and movement on a torus.

Source: Le (2019), "The Simulated World of Foods and Agents".
`docs/explanation/model.md` lists the choices that the paper leaves open.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import for_each, select_by_type
from baldwinlab.engine.rng import BIRTHPLACE, HEADING, MOTOR, philox, unit
from baldwinlab.engine.simd import HALF, ONE, TWO, ZERO, Lane, Mask, Value, choose, get, put
from baldwinlab.models.miniworld.state import HEADING_COUNT, MiniWorldModel, State
from baldwinlab.parts.bodies import move
from baldwinlab.parts.world_features import blocks_movement, blocks_placement

N_HEADINGS = np.float32(HEADING_COUNT)
# Maximum number of attempts to find an allowed birthplace. The last attempt ignores features.
MAX_ATTEMPTS = 100_000


@compiled
def combine_masks(first_mask: Mask, second_mask: Mask) -> Mask:
    """Return where either mask is true."""
    return first_mask | second_mask


# Return whether any feature blocks a position for newborns and items.
is_placement_blocked = for_each(blocks_placement, False, combine_masks)
# Return whether any feature blocks movement.
is_movement_blocked = for_each(blocks_movement, False, combine_masks)


@compiled
def wrap_position(position: Value, span: np.float32) -> Value:
    """Return a coordinate wrapped into [0, span), on the torus.

    Parameters
    ----------
    position : float32, or a SIMD block
        Coordinate, in units of length, at most one `span` outside the map.
    span : float32
        Width or height of the map.

    Returns
    -------
    float32, or a SIMD block
        The coordinate on the map.
    """
    position = choose(position < ZERO, position + span, position)
    return choose(position < span, position, position - span)


@compiled
def shortest_difference(difference: Value, span: np.float32) -> Value:
    """Return the shortest difference of two coordinates on the torus.

    Parameters
    ----------
    difference : float32, or a SIMD block
        Difference of two coordinates on the map, in units of length.
    span : float32
        Width or height of the map.

    Returns
    -------
    float32, or a SIMD block
        The difference in [-span / 2, span / 2].
    """
    half = span * HALF
    difference = choose(difference > half, difference - span, difference)
    return choose(difference < -half, difference + span, difference)


@compiled
def place_newborn(model: MiniWorldModel, state: State, world: int, agent: int, number: int) -> None:
    """Set the heading of a newborn agent, and a position that is uniform in the start disc.

    The heading is 0, or random with `model.random_headings`. `number` selects the random numbers.
    """
    seed = state.keys[world, 0]
    run = state.keys[world, 1]
    center_x = model.start[0]
    center_y = model.start[1]
    radius = model.start[2]
    # Position in units of the radius, relative to the center. The loop replaces (1, 1).
    x = ONE
    y = ONE
    attempt = 0
    lane = world * model.agents + agent
    is_searching = True
    # Rejection sampling from the enclosing square, until a point is in the disc and allowed.
    while is_searching:
        words = philox(attempt, number, state.generation[0], BIRTHPLACE, seed, run)
        x = TWO * unit(words[0]) - ONE
        y = TWO * unit(words[1]) - ONE
        attempt += 1
        state.positions[0, lane] = wrap_position(center_x + radius * x, model.width)
        state.positions[1, lane] = wrap_position(center_y + radius * y, model.height)
        is_blocked = (
            is_placement_blocked(
                state.features, model, state.positions[0, lane], state.positions[1, lane]
            )
            and attempt < MAX_ATTEMPTS
        )
        is_outside_disc = bool(x * x + y * y > ONE)
        is_searching = is_outside_disc or is_blocked
    state.heading[0, lane] = ZERO
    if model.random_headings:
        words = philox(0, number, state.generation[0], HEADING, seed, run)
        state.heading[0, lane] = np.float32(int(N_HEADINGS * unit(words[0])))


@compiled
def apply_motor_noise(
    model: MiniWorldModel, state: State, world: int, lane: int, agent: int, step: int
) -> None:
    """Replace the chosen action by a random action, with probability `model.action_noise`."""
    # The first word decides whether the action is replaced, and the second word chooses an action.
    words = philox(
        step, agent, state.generation[0], MOTOR, state.keys[world, 0], state.keys[world, 1]
    )
    actions = np.float32(state.targets.shape[0])
    if unit(words[0]) < model.action_noise:
        state.action[0, lane] = np.float32(int(actions * unit(words[1])))


@compiled
def _move_unless_blocked(features: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
    """Move the agents. A blocked agent stays at the old position."""
    old_x = get(state.positions, 0, lane)
    old_y = get(state.positions, 1, lane)
    move(state.body, model, state, lane)
    x = get(state.positions, 0, lane)
    y = get(state.positions, 1, lane)
    is_blocked = is_movement_blocked(features, model, x, y)
    put(state.positions, 0, lane, choose(is_blocked, old_x, x))
    put(state.positions, 1, lane, choose(is_blocked, old_y, y))


@compiled
def _move_freely(features: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
    """Move the agents, for experiments without world features."""
    move(state.body, model, state, lane)


move_agents = select_by_type(_move_unless_blocked, _move_freely)
