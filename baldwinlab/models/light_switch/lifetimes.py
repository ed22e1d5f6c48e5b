"""Lifetimes of robots in the arena: senses, neurons and movement."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import square_root
from baldwinlab.models.miniworld.learning.hebbian import compute_strength_change

# Number of inputs: four for the lamp, three for the stripe, three for walls, and a bias of 1.
N_INPUTS: Final = 11
# Distance per step at full speed, in sides of the arena.
FULL_SPEED = np.float32(0.02)
# Tangent of half the turning angle per step, if the wheels turn at full speed in opposite
# directions.
MAX_TURN_TANGENT = np.float32(0.15)
# Radius of the lamp and of the stripe, in sides of the arena.
LAMP_RADIUS = np.float32(0.2)
# Distance from which a wall is sensed, in sides of the arena.
WALL_SENSE_DISTANCE = np.float32(0.1)
ZERO, ONE, TWO, THREE = (np.float32(number) for number in range(4))


@jit_entry_point
def simulate_lifetimes(
    n_steps: int,
    world: Any,
    initial_draws: Any,
    signs: Any,
    rules: Any,
    rates: Any,
    weights: Any,
    values: Any,
    lit_steps: Any,
) -> None:
    """Simulate lifetimes and count the steps under the lit lamp.

    Parameters
    ----------
    n_steps : int
        Number of steps of a lifetime.
    world : array of shape (6,)
        Layout of the arena, as in `STANDARD_WORLD`.
    initial_draws : array of shape (runs, 4)
        Uniform numbers for the initial position and heading.
    signs, rules, rates : arrays of shape (runs, agents, neurons, sources)
        Signs, learning rules and learning rates of the synapses.
    weights : array of shape (runs, agents, neurons, sources)
        Weights. They change in place as agents learn.
    values : array of shape (2, inputs + neurons)
        Scratch.
    lit_steps : array of shape (runs, agents)
        Output: the number of steps under the lit lamp.
    """
    for run in range(lit_steps.shape[0]):
        for agent in range(lit_steps.shape[1]):
            lit_steps[run, agent] = _simulate_lifetime(
                n_steps,
                world,
                initial_draws[run],
                signs[run, agent],
                rules[run, agent],
                rates[run, agent],
                weights[run, agent],
                values,
            )


@compiled
def _simulate_lifetime(
    n_steps: Any,
    world: Any,
    initial_draws: Any,
    signs: Any,
    rules: Any,
    rates: Any,
    weights: Any,
    values: Any,
) -> int:
    """Simulate one lifetime and return the number of steps under the lit lamp."""
    current = values[0]
    previous = values[1]
    current[:] = ZERO
    x = np.float32(0.3) + np.float32(0.4) * initial_draws[0]
    y = np.float32(0.2) + np.float32(0.6) * initial_draws[1]
    # The heading is the unit vector (heading_x, heading_y).
    heading_x = TWO * initial_draws[2] - ONE
    heading_y = TWO * initial_draws[3] - ONE
    length = square_root(heading_x * heading_x + heading_y * heading_y)
    heading_x, heading_y = (
        (heading_x / length, heading_y / length) if length > ZERO else (ONE, ZERO)
    )
    is_lit = False
    steps_under = 0
    for _ in range(n_steps):
        is_lit = is_lit or _is_within_reach(x - world[0], y - world[1])
        steps_under += 1 if is_lit and _is_within_reach(x - world[2], y - world[3]) else 0
        for source in range(current.size):
            previous[source] = current[source]
        _sense(world, is_lit, x, y, heading_x, heading_y, previous)
        _update_neurons(signs, rules, rates, weights, previous, current)
        # Speeds of the two wheels, in [-1, 1].
        left = TWO * current[current.size - 2] - ONE
        right = TWO * current[current.size - 1] - ONE
        left = left * world[5]
        # Tangent t of half the turning angle. The cosine is (1 - t^2) / (1 + t^2), the sine is
        # 2 t / (1 + t^2).
        tangent = MAX_TURN_TANGENT * (right - left) / TWO
        squared_tangent = tangent * tangent
        cosine = (ONE - squared_tangent) / (ONE + squared_tangent)
        sine = TWO * tangent / (ONE + squared_tangent)
        turned_x = heading_x * cosine - heading_y * sine
        heading_y = heading_y * cosine + heading_x * sine
        heading_x = turned_x
        distance = FULL_SPEED * (left + right) / TWO
        x = min(max(x + distance * heading_x, ZERO), ONE)
        y = min(max(y + distance * heading_y, ZERO), ONE)
    return steps_under


@compiled
def _is_within_reach(dx: Any, dy: Any) -> bool:
    return bool(dx * dx + dy * dy < LAMP_RADIUS * LAMP_RADIUS)


@compiled
def _sense(
    world: Any, is_lit: Any, x: Any, y: Any, heading_x: Any, heading_y: Any, values: Any
) -> None:
    """Fill the inputs, in [0, 1], in the order of `N_INPUTS`.

    The sensed light decreases with the distance of the lamp and with its angle from the sensor.
    """
    dx = world[2] - x
    dy = world[3] - y
    distance = square_root(dx * dx + dy * dy)
    light = max(ZERO, ONE - distance) / distance if is_lit and distance > ZERO else ZERO
    ahead = light * (dx * heading_x + dy * heading_y)
    left = light * (dy * heading_x - dx * heading_y)
    values[0] = max(ZERO, ahead)
    values[1] = max(ZERO, left)
    values[2] = max(ZERO, -ahead)
    values[3] = max(ZERO, -left)
    dx = world[0] - x
    dy = world[1] - y
    ahead = dx * heading_x + dy * heading_y
    left = dy * heading_x - dx * heading_y
    # The stripe is visible within an eighth of a turn.
    is_visible = ahead > abs(left)
    values[4] = ONE if is_visible and THREE * left > ahead else ZERO
    values[5] = ONE if is_visible and THREE * abs(left) <= ahead else ZERO
    values[6] = ONE if is_visible and THREE * left < -ahead else ZERO
    values[7] = _sense_wall(x, y, heading_x, heading_y)
    values[8] = _sense_wall(x, y, -heading_y, heading_x)
    values[9] = _sense_wall(x, y, heading_y, -heading_x)
    for number in range(N_INPUTS - 1):
        values[number] *= world[4]
    values[N_INPUTS - 1] = ONE


@compiled
def _sense_wall(x: Any, y: Any, dx: Any, dy: Any) -> Any:
    """Return the nearness of the nearest wall in a direction, in [0, 1].

    The value is larger if the direction is closer to the perpendicular of the wall.
    """
    nearness_x = abs(dx) * max(ZERO, ONE - (ONE - x if dx > ZERO else x) / WALL_SENSE_DISTANCE)
    nearness_y = abs(dy) * max(ZERO, ONE - (ONE - y if dy > ZERO else y) / WALL_SENSE_DISTANCE)
    return max(nearness_x, nearness_y)


@compiled
def _update_neurons(
    signs: Any, rules: Any, rates: Any, weights: Any, previous: Any, current: Any
) -> None:
    """Fill the neurons in `current` from `previous`, and update the weights.

    `previous` [source] has the inputs and the neurons of the previous step.
    """
    for neuron in range(rules.shape[0]):
        total = ZERO
        for source in range(previous.size):
            total += signs[neuron, source] * weights[neuron, source] * previous[source]
        activation = sigmoid(total)
        current[N_INPUTS + neuron] = activation
        for source in range(previous.size):
            weight = weights[neuron, source]
            rate = rates[neuron, source]
            if rate > ZERO:
                weight += rate * compute_strength_change(
                    rules[neuron, source], weight, previous[source], activation
                )
                weights[neuron, source] = min(max(weight, ZERO), ONE)
