"""Lifetimes of the robots of `light_switch.py` in the arena: senses, neurons and movement."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import square_root
from baldwinlab.models.miniworld.learning.hebbian import compute_strength_change

# Number of inputs, in order: four for the lamp, three for the stripe, three for walls, a bias of 1.
N_INPUTS: Final = 11
# Distance per step at full speed, in sides of the arena.
FULL_SPEED = np.float32(0.02)
# Tangent of half the turning angle per step, if the wheels turn at full speed in opposite
# directions.
MAX_TURN_TANGENT = np.float32(0.15)
# Radius of the lamp and of the stripe, in sides of the arena.
LAMP_RADIUS = np.float32(0.2)
# Largest distance at which a wall is sensed, in sides of the arena.
WALL_SENSE_DISTANCE = np.float32(0.1)
ZERO, ONE, TWO, THREE = (np.float32(number) for number in range(4))


class Arena(NamedTuple):
    """Layout of the arena, in sides of the arena."""

    stripe_x: Any
    stripe_y: Any
    lamp_x: Any
    lamp_y: Any
    # Factor of all inputs except the bias. 1 in the standard world.
    sense_strength: Any
    # Factor of the speed of the left wheel. 1 in the standard world.
    left_wheel_speed: Any


class Synapses(NamedTuple):
    """Synapses of all agents [run, agent, neuron, source], or of one agent [neuron, source]."""

    # 1 or -1.
    signs: npt.NDArray[np.float32]
    # Code of the learning rule, 0 to 3, see `compute_strength_change`.
    rules: npt.NDArray[np.int64]
    # Learning rate. 0: the weight does not change.
    rates: npt.NDArray[np.float32]
    weights: npt.NDArray[np.float32]  # Strength, from 0 to 1.


@jit_entry_point
def simulate_lifetimes(
    n_steps: int,
    world: Arena,
    initial_draws: Any,
    synapses: Synapses,
    values: Any,
    lit_steps: Any,
) -> None:
    """Simulate lifetimes and count the steps under the lit lamp.

    - `initial_draws` (runs, 4): uniform random numbers for the initial position and heading.
    - `synapses`: synapses of all agents. Learning changes the weights in place.
    - `values` (2, inputs + neurons): scratch.
    - `lit_steps` (runs, agents): output: the number of steps under the lit lamp.
    """
    for run in range(lit_steps.shape[0]):
        for agent in range(lit_steps.shape[1]):
            agent_synapses = Synapses(
                synapses.signs[run, agent],
                synapses.rules[run, agent],
                synapses.rates[run, agent],
                synapses.weights[run, agent],
            )
            lit_steps[run, agent] = _simulate_lifetime(
                n_steps, world, initial_draws[run], agent_synapses, values
            )


@compiled
def _simulate_lifetime(
    n_steps: Any, world: Arena, initial_draws: Any, synapses: Synapses, values: Any
) -> int:
    """Simulate one lifetime and return the number of steps under the lit lamp."""
    current = values[0]
    previous = values[1]
    current[:] = ZERO
    # The robot begins in the central part of the arena: x from 0.3 to 0.7, y from 0.2 to 0.8.
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
    n_lit_steps = 0
    for _ in range(n_steps):
        # The lamp stays lit after the robot has reached the stripe.
        is_lit = is_lit or _is_within_reach(x - world.stripe_x, y - world.stripe_y)
        is_at_lamp = _is_within_reach(x - world.lamp_x, y - world.lamp_y)
        n_lit_steps += int(is_lit and is_at_lamp)
        for source in range(current.size):
            previous[source] = current[source]
        _fill_inputs(world, is_lit, x, y, heading_x, heading_y, previous)
        _update_neurons(synapses, previous, current)
        # Speeds of the two wheels, in [-1, 1], from the last two neurons.
        left = TWO * current[current.size - 2] - ONE
        right = TWO * current[current.size - 1] - ONE
        left = left * world.left_wheel_speed
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
    return n_lit_steps


@compiled
def _is_within_reach(dx: Any, dy: Any) -> bool:
    return bool(dx * dx + dy * dy < LAMP_RADIUS * LAMP_RADIUS)


@compiled
def _fill_inputs(
    world: Arena, is_lit: Any, x: Any, y: Any, heading_x: Any, heading_y: Any, values: Any
) -> None:
    """Fill the inputs in `values` [source], in [0, 1], in the order of `N_INPUTS`.

    Sensed light decreases with the distance of the lamp, and with its angle from the sensor.
    """
    dx = world.lamp_x - x
    dy = world.lamp_y - y
    distance = square_root(dx * dx + dy * dy)
    light = max(ZERO, ONE - distance) / distance if is_lit and distance > ZERO else ZERO
    ahead = light * (dx * heading_x + dy * heading_y)
    left = light * (dy * heading_x - dx * heading_y)
    values[0] = max(ZERO, ahead)
    values[1] = max(ZERO, left)
    values[2] = max(ZERO, -ahead)
    values[3] = max(ZERO, -left)
    dx = world.stripe_x - x
    dy = world.stripe_y - y
    ahead = dx * heading_x + dy * heading_y
    left = dy * heading_x - dx * heading_y
    # The stripe is visible up to 45 degrees to the left and right. One of the three sensors is 1:
    # ahead if the tangent of the angle is at most 1/3, otherwise left or right.
    is_visible = ahead > abs(left)
    values[4] = ONE if is_visible and THREE * left > ahead else ZERO
    values[5] = ONE if is_visible and THREE * abs(left) <= ahead else ZERO
    values[6] = ONE if is_visible and THREE * left < -ahead else ZERO
    values[7] = _sense_wall(x, y, heading_x, heading_y)
    values[8] = _sense_wall(x, y, -heading_y, heading_x)
    values[9] = _sense_wall(x, y, heading_y, -heading_x)
    # The factor does not apply to the bias, which is the last input.
    for input_index in range(N_INPUTS - 1):
        values[input_index] *= world.sense_strength
    values[N_INPUTS - 1] = ONE


@compiled
def _sense_wall(x: Any, y: Any, dx: Any, dy: Any) -> Any:
    """Return the nearness of the nearest wall in the direction (dx, dy), in [0, 1].

    Nearness is 1 at a wall that is perpendicular to the direction, and smaller for other angles.
    """
    distance_x = ONE - x if dx > ZERO else x
    distance_y = ONE - y if dy > ZERO else y
    nearness_x = abs(dx) * max(ZERO, ONE - distance_x / WALL_SENSE_DISTANCE)
    nearness_y = abs(dy) * max(ZERO, ONE - distance_y / WALL_SENSE_DISTANCE)
    return max(nearness_x, nearness_y)


@compiled
def _update_neurons(synapses: Synapses, previous: Any, current: Any) -> None:
    """Fill the neurons in `current` from `previous`, and update the weights.

    `previous` [source]: current inputs, and values of the neurons in the previous step.
    """
    signs = synapses.signs
    rules = synapses.rules
    rates = synapses.rates
    weights = synapses.weights
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
