"""Lifetimes of robots in the arena: senses, neurons and movement."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import square_root
from baldwinlab.models.miniworld.learning.hebbian import strength_change

# Four for the lamp, three for the stripe, three for walls, and a bias that is always 1.
N_INPUTS: Final = 11
# Distance per step at full speed, in sides of the arena.
FULL_SPEED = np.float32(0.02)
# Half the tangent of half the turning angle at full speed.
TURN_FACTOR = np.float32(0.15)
# Radius of the lamp and of the stripe, in sides of the arena.
LAMP_RADIUS = np.float32(0.2)
# Distance from which a wall is sensed, in sides of the arena.
WALL_SENSE_DISTANCE = np.float32(0.1)
ZERO, ONE, TWO, THREE = (np.float32(number) for number in range(4))


@jit_entry_point
def drive(
    moves: int,
    world: Any,
    begin: Any,
    signs: Any,
    rules: Any,
    rates: Any,
    weights: Any,
    values: Any,
    lit: Any,
) -> None:
    """Simulate lifetimes and count the steps under the lit lamp.

    Parameters
    ----------
    moves : int
        Number of steps of a lifetime.
    world : array of shape (6,)
        Layout of the arena, as `STANDARD_WORLD`.
    begin : array of shape (runs, 4)
        Uniform numbers for the initial position and heading.
    signs, rules, rates : arrays of shape (runs, agents, neurons, sources)
        Signs, learning rules and learning rates of the synapses.
    weights : array of shape (runs, agents, neurons, sources)
        Weights. They change in place as agents learn.
    values : array of shape (2, inputs + neurons)
        Scratch.
    lit : array of shape (runs, agents)
        Output: the number of steps under the lit lamp.
    """
    for run in range(lit.shape[0]):
        for agent in range(lit.shape[1]):
            lit[run, agent] = _simulate_lifetime(
                moves,
                world,
                begin[run],
                signs[run, agent],
                rules[run, agent],
                rates[run, agent],
                weights[run, agent],
                values,
            )


@compiled
def _simulate_lifetime(
    moves: Any,
    world: Any,
    begin: Any,
    signs: Any,
    rules: Any,
    rates: Any,
    weights: Any,
    values: Any,
) -> int:
    """Simulate one lifetime and return the number of steps under the lit lamp."""
    now = values[0]
    before = values[1]
    now[:] = ZERO
    x = np.float32(0.3) + np.float32(0.4) * begin[0]
    y = np.float32(0.2) + np.float32(0.6) * begin[1]
    along = TWO * begin[2] - ONE
    across = TWO * begin[3] - ONE
    length = square_root(along * along + across * across)
    along, across = (along / length, across / length) if length > ZERO else (ONE, ZERO)
    is_lit = False
    steps_under = 0
    for _ in range(moves):
        is_lit = is_lit or _is_within_reach(x - world[0], y - world[1])
        steps_under += 1 if is_lit and _is_within_reach(x - world[2], y - world[3]) else 0
        for k in range(now.size):
            before[k] = now[k]
        _sense(world, is_lit, x, y, along, across, before)
        _update_neurons(signs, rules, rates, weights, before, now)
        left = TWO * now[now.size - 2] - ONE
        right = TWO * now[now.size - 1] - ONE
        left = left * world[5]
        # The tangent of half the turning angle. Sine and cosine follow from it by division.
        turn = TURN_FACTOR * (right - left) / TWO
        square = turn * turn
        cosine = (ONE - square) / (ONE + square)
        sine = TWO * turn / (ONE + square)
        turned_along = along * cosine - across * sine
        across = across * cosine + along * sine
        along = turned_along
        ahead = FULL_SPEED * (left + right) / TWO
        x = min(max(x + ahead * along, ZERO), ONE)
        y = min(max(y + ahead * across, ZERO), ONE)
    return steps_under


@compiled
def _is_within_reach(dx: Any, dy: Any) -> bool:
    return bool(dx * dx + dy * dy < LAMP_RADIUS * LAMP_RADIUS)


@compiled
def _sense(world: Any, is_lit: Any, x: Any, y: Any, along: Any, across: Any, values: Any) -> None:
    """Fill the inputs, in [0, 1].

    The light of the lamp decreases with distance and angle. Walls are sensed from a short distance.
    """
    dx = world[2] - x
    dy = world[3] - y
    distance = square_root(dx * dx + dy * dy)
    light = max(ZERO, ONE - distance) / distance if is_lit and distance > ZERO else ZERO
    ahead = light * (dx * along + dy * across)
    left = light * (dy * along - dx * across)
    values[0] = max(ZERO, ahead)
    values[1] = max(ZERO, left)
    values[2] = max(ZERO, -ahead)
    values[3] = max(ZERO, -left)
    dx = world[0] - x
    dy = world[1] - y
    ahead = dx * along + dy * across
    left = dy * along - dx * across
    # The stripe is visible within an eighth of a turn.
    is_visible = ahead > abs(left)
    values[4] = ONE if is_visible and THREE * left > ahead else ZERO
    values[5] = ONE if is_visible and THREE * abs(left) <= ahead else ZERO
    values[6] = ONE if is_visible and THREE * left < -ahead else ZERO
    values[7] = _sense_wall(x, y, along, across)
    values[8] = _sense_wall(x, y, -across, along)
    values[9] = _sense_wall(x, y, across, -along)
    for i in range(N_INPUTS - 1):
        values[i] *= world[4]
    values[N_INPUTS - 1] = ONE


@compiled
def _sense_wall(x: Any, y: Any, dx: Any, dy: Any) -> Any:
    """Return the nearness of the nearest wall in a direction, in [0, 1].

    The value is larger if the direction is closer to perpendicular.
    """
    of_x = abs(dx) * max(ZERO, ONE - (ONE - x if dx > ZERO else x) / WALL_SENSE_DISTANCE)
    of_y = abs(dy) * max(ZERO, ONE - (ONE - y if dy > ZERO else y) / WALL_SENSE_DISTANCE)
    return max(of_x, of_y)


@compiled
def _update_neurons(
    signs: Any, rules: Any, rates: Any, weights: Any, before: Any, now: Any
) -> None:
    """Fill the neurons of `now` from the inputs and neurons of `before`, and update the weights."""
    for neuron in range(rules.shape[0]):
        total = ZERO
        for source in range(before.size):
            total += signs[neuron, source] * weights[neuron, source] * before[source]
        y = sigmoid(total)
        now[N_INPUTS + neuron] = y
        for source in range(before.size):
            w = weights[neuron, source]
            rate = rates[neuron, source]
            if rate > ZERO:
                w += rate * strength_change(rules[neuron, source], w, before[source], y)
                weights[neuron, source] = min(max(w, ZERO), ONE)
