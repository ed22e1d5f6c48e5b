"""Lifetimes of foragers on successive grids with food. A network can learn in each step.

`cell_foragers.py` calls `simulate_lifetimes`.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import share_of_turn, sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import HALF, ONE, ZERO, square_root
from baldwinlab.parts import LIFE, philox, unit

# Number of cells per edge.
GRID_SIZE: Final = 10
# Number of food items in an environment.
N_FOOD_ITEMS: Final = 10
# Codes of the actions. Code 0 means stay.
TURN_RIGHT, TURN_LEFT, GO_AHEAD = range(1, 4)
# Number of random draws that are reserved for an environment. A draw has four random words.
DRAWS_PER_ENVIRONMENT: Final = 4096
# Learning targets, see `CellForagers.learning`.
NO_TARGET, INHERITED_TEACHER, NEXT_SENSATION, NOISE = range(4)
# Number of inputs: angle and distance of the nearest food, and the two bits of the next action.
N_INPUTS: Final = 4
# Number of outputs for the action: its two bits.
N_ACTION_OUTPUTS: Final = 2
# Distance between opposite corners, in cells. The factor is the square root of 2.
MAX_DISTANCE: Final = np.float32(GRID_SIZE - 1) * np.float32(1.4142135)


class Visit(NamedTuple):
    """Key of the random numbers of an agent in one environment."""

    seed: int
    run: int
    generation: int
    agent: int
    # Index of the first draw of the environment, among all draws of the lifetime.
    first_draw: int


@compiled
def draw_words(visit: Visit, draw_index: Any) -> Any:
    """Return the four random words of a draw. Draw 0 is the first draw of the visit."""
    return philox(
        visit.first_draw + draw_index, visit.agent, visit.generation, LIFE, visit.seed, visit.run
    )


@compiled
def draw_cell(word: Any) -> int:
    """Return the index of a random cell. Cell 0 is the first cell of row 0, cell 10 of row 1."""
    return int(unit(word) * np.float32(GRID_SIZE * GRID_SIZE))


@compiled
def place_food(food: Any, visit: Visit) -> None:
    """Fill `food` [item] with different random cells. If a cell has food, another one is drawn."""
    # Draw 0 determines the initial cell and heading of the agent, so food begins with draw 1.
    draw_index = 0
    for item in range(food.size):
        is_free = False
        while not is_free:
            draw_index += 1
            cell = draw_cell(draw_words(visit, draw_index)[0])
            is_free = True
            for earlier_item in range(item):
                is_free = is_free and food[earlier_item] != cell
            food[item] = cell


@compiled
def sense_food(food: Any, cell: Any, heading: Any) -> Any:
    """Return the angle and the distance of the nearest food, or (0, 1) if there is no food.

    The angle is clockwise from the heading, in turns, from 0 to 1. The distance is divided by
    `MAX_DISTANCE`, so it is from 0 to 1. `food` [item]: cell of each item, -1 if it is eaten.
    """
    # This value is larger than all squared distances on the grid.
    no_distance = 2 * GRID_SIZE * GRID_SIZE
    nearest_squared = no_distance
    nearest_dx = 0
    nearest_dy = 0
    for item in range(food.size):
        if food[item] >= 0:
            dx = food[item] % GRID_SIZE - cell % GRID_SIZE
            dy = food[item] // GRID_SIZE - cell // GRID_SIZE
            squared_distance = dx * dx + dy * dy
            if squared_distance < nearest_squared:
                nearest_squared = squared_distance
                nearest_dx = dx
                nearest_dy = dy
    if nearest_squared == no_distance:
        return ZERO, ONE
    # Rotate the offset counterclockwise by the heading, so that straight ahead is to the right.
    for _ in range(heading):
        nearest_dx, nearest_dy = nearest_dy, -nearest_dx
    angle = share_of_turn(np.float32(nearest_dx), np.float32(nearest_dy))
    distance = square_root(np.float32(nearest_squared)) / MAX_DISTANCE
    return angle, distance


@compiled
def execute_action(action: Any, cell: Any, heading: Any) -> Any:
    """Return the cell and the heading (0 right, 1 down, 2 left, 3 up) after an action."""
    if action == TURN_RIGHT:
        return cell, (heading + 1) % 4
    if action == TURN_LEFT:
        return cell, (heading + 3) % 4
    if action == GO_AHEAD:
        x = cell % GRID_SIZE + int(heading == 0) - int(heading == 2)
        y = cell // GRID_SIZE + int(heading == 1) - int(heading == 3)
        if 0 <= x < GRID_SIZE and 0 <= y < GRID_SIZE:
            return y * GRID_SIZE + x, heading
    return cell, heading


@compiled
def eat_item(food: Any, cell: Any) -> int:
    """Remove the item in a cell, if it has one. Return the number of eaten items, 0 or 1."""
    n_eaten = 0
    for item in range(food.size):
        if food[item] == cell:
            food[item] = -1
            n_eaten = 1
    return n_eaten


class Layers(NamedTuple):
    """Numbers of hidden units and of outputs of a network, and the learning rate."""

    hidden: int
    outputs: int
    rate: np.float32


class Activations(NamedTuple):
    """Scratch arrays for the activations of both modules and for one step of learning."""

    # [unit]: inputs, then hidden units, then outputs of the action module.
    values: npt.NDArray[np.float32]
    # [unit]: inputs, then hidden units, then outputs of the teaching module.
    teacher: npt.NDArray[np.float32]
    # [2]: target values of the two trained outputs.
    targets: npt.NDArray[np.float32]


@compiled
def compute_outputs(layers: Layers, weights: Any, values: Any) -> None:
    """Compute the hidden units and the outputs in `values` [unit] from the inputs in `values`."""
    hidden = layers.hidden
    outputs = layers.outputs
    for hidden_unit in range(hidden):
        total = weights[N_INPUTS * hidden + hidden_unit]
        for source in range(N_INPUTS):
            total += weights[source * hidden + hidden_unit] * values[source]
        values[N_INPUTS + hidden_unit] = sigmoid(total)
    # Order of weights: [input, hidden unit], hidden biases, [hidden unit, output], output biases.
    first_output_weight = (N_INPUTS + 1) * hidden
    for output in range(outputs):
        total = weights[first_output_weight + hidden * outputs + output]
        for hidden_unit in range(hidden):
            total += (
                weights[first_output_weight + hidden_unit * outputs + output]
                * values[N_INPUTS + hidden_unit]
            )
        values[N_INPUTS + hidden + output] = sigmoid(total)


@compiled
def backpropagate(layers: Layers, weights: Any, units: Activations, first: Any) -> None:
    """Do one step of backpropagation, from `units.targets` for the outputs `first`, `first + 1`."""
    hidden = layers.hidden
    outputs = layers.outputs
    rate = layers.rate
    values = units.values
    first_output = N_INPUTS + hidden + first
    first_error = _output_error(values[first_output], units.targets[0])
    second_error = _output_error(values[first_output + 1], units.targets[1])
    output_weights = (N_INPUTS + 1) * hidden + first
    for hidden_unit in range(hidden):
        activation = values[N_INPUTS + hidden_unit]
        weight = output_weights + hidden_unit * outputs
        error = ZERO
        error += first_error * weights[weight]
        error += second_error * weights[weight + 1]
        weights[weight] -= rate * first_error * activation
        weights[weight + 1] -= rate * second_error * activation
        error = error * activation * (ONE - activation)
        for source in range(N_INPUTS):
            weights[source * hidden + hidden_unit] -= rate * error * values[source]
        weights[N_INPUTS * hidden + hidden_unit] -= rate * error
    biases = output_weights + hidden * outputs
    weights[biases] -= rate * first_error
    weights[biases + 1] -= rate * second_error


@compiled
def _output_error(activation: Any, target: Any) -> Any:
    return (activation - target) * activation * (ONE - activation)


class ForagingSettings(NamedTuple):
    """Settings that are the same for all agents of a generation."""

    seed: int
    generation: int
    # Index in the population of the first simulated agent.
    first_agent: int
    # Kind of learning target: `NO_TARGET`, `INHERITED_TEACHER`, `NEXT_SENSATION` or `NOISE`.
    target: int
    layers: Layers


class Modules(NamedTuple):
    """Weights [weight] of the action module and the teaching module of an agent."""

    action: npt.NDArray[np.float32]
    teaching: npt.NDArray[np.float32]


class EnvironmentPath(NamedTuple):
    """Food and moves of an agent in one environment."""

    # [item]: cell of each item at the beginning.
    food: npt.NDArray[np.int64]
    # [move, (cell, heading)]: cell and heading after each move.
    track: npt.NDArray[np.int64]


class Scratch(NamedTuple):
    """Working memory. All agents use the same arrays, one agent after another."""

    # [item]: cell of each item, -1 if it is eaten.
    food: npt.NDArray[np.int64]
    units: Activations


class ForagingResults(NamedTuple):
    """Results of lifetimes, and the paths of the last simulated agent."""

    # [run, agent, weight]: the action module. Learning changes it in place.
    learned: npt.NDArray[np.float32]
    # [run, agent, environment]: number of eaten items.
    eaten: npt.NDArray[np.int32]
    # [environment, item]: cell of each item at the beginning.
    food: npt.NDArray[np.int64]
    # [environment, move, (cell, heading)]: cell and heading after each move.
    track: npt.NDArray[np.int64]


@jit_entry_point
def simulate_lifetimes(
    settings: ForagingSettings, runs: Any, teaching: Any, scratch: Scratch, results: ForagingResults
) -> None:
    """Simulate the lifetimes of all agents, and fill `results`.

    `teaching` (runs, agents, weights): weights of the teaching modules. Before the call,
    `results.learned` must contain the weights of the action modules at birth.
    """
    n_recorded = results.food.shape[0]
    for run in range(runs.size):
        for agent in range(results.eaten.shape[1]):
            modules = Modules(results.learned[run, agent], teaching[run, agent])
            for environment in range(results.eaten.shape[2]):
                visit = Visit(
                    seed=settings.seed,
                    run=runs[run],
                    generation=settings.generation,
                    agent=settings.first_agent + agent,
                    first_draw=environment * DRAWS_PER_ENVIRONMENT,
                )
                # With fewer slots than environments, later paths overwrite earlier paths.
                slot = environment % n_recorded
                path = EnvironmentPath(results.food[slot], results.track[slot])
                results.eaten[run, agent, environment] = _visit_environment(
                    settings, visit, modules, scratch, path
                )


@compiled
def _visit_environment(
    settings: ForagingSettings,
    visit: Visit,
    modules: Modules,
    scratch: Scratch,
    path: EnvironmentPath,
) -> int:
    """Simulate an agent in one environment, and return the number of items that it eats."""
    food = scratch.food
    values = scratch.units.values
    words = draw_words(visit, 0)
    cell = draw_cell(words[0])
    heading = int(unit(words[1]) * np.float32(4))
    place_food(food, visit)
    for item in range(food.size):
        path.food[item] = food[item]
    action = 0
    eaten = 0
    # The reference is an earlier move: its index, the state after it, and the items eaten by then.
    reference_move = -1
    reference_state = -1
    reference_eaten = 0
    angle, distance = sense_food(food, cell, heading)
    for move in range(path.track.shape[0]):
        values[0] = angle
        values[1] = distance
        # The two bits of the next action.
        values[2] = np.float32(action >> 1)
        values[3] = np.float32(action & 1)
        compute_outputs(settings.layers, modules.action, values)
        cell, heading = execute_action(action, cell, heading)
        eaten += eat_item(food, cell)
        path.track[move, 0] = cell
        path.track[move, 1] = heading
        action = _read_action(settings.layers, values)
        if settings.target == NO_TARGET:
            # Without learning, the next move depends only on the state and on the food. Therefore,
            # an agent repeats its moves if it returns to an earlier state and has eaten no item
            # since. Heading and next action have four values each, so one integer is the state.
            state = 16 * cell + 4 * heading + action
            if state == reference_state and eaten == reference_eaten:
                _repeat_moves(path.track, move, move - reference_move)
                return eaten
            # A state before the loop of moves never returns. Therefore, the reference is replaced
            # by a later state at growing intervals.
            if eaten > reference_eaten or move > 2 * reference_move:
                reference_move = move
                reference_state = state
                reference_eaten = eaten
        angle, distance = sense_food(food, cell, heading)
        scratch.units.targets[0] = angle
        scratch.units.targets[1] = distance
        _learn(settings, visit, modules, scratch.units, move)
    return eaten


@compiled
def _read_action(layers: Layers, values: Any) -> int:
    """Return the code of the action. Its two bits are 1 if the first two outputs are above 1/2."""
    # The order of `values` is: inputs, hidden units, outputs.
    first_output = N_INPUTS + layers.hidden
    return 2 * int(values[first_output] > HALF) + int(values[first_output + 1] > HALF)


@compiled
def _learn(
    settings: ForagingSettings, visit: Visit, modules: Modules, units: Activations, move: Any
) -> None:
    """Change the weights of the action module in one step of learning.

    Before the call, `units.targets` must contain the angle and the distance of the nearest food
    after the move. A teacher or noise overwrites these targets.
    """
    layers = settings.layers
    if settings.target == INHERITED_TEACHER:
        for index in range(N_INPUTS):
            units.teacher[index] = units.values[index]
        compute_outputs(layers, modules.teaching, units.teacher)
        for index in range(N_ACTION_OUTPUTS):
            units.targets[index] = units.teacher[N_INPUTS + layers.hidden + index]
        backpropagate(layers, modules.action, units, 0)
    elif settings.target == NEXT_SENSATION:
        backpropagate(layers, modules.action, units, N_ACTION_OUTPUTS)
    elif settings.target == NOISE:
        # Noise counts backward from the last draw, because food uses the first draws.
        words = draw_words(visit, DRAWS_PER_ENVIRONMENT - 1 - move)
        units.targets[0] = unit(words[0])
        units.targets[1] = unit(words[1])
        backpropagate(layers, modules.action, units, N_ACTION_OUTPUTS)


@compiled
def _repeat_moves(track: Any, move: Any, period: Any) -> None:
    """Fill the track after `move` by repeating the last `period` moves."""
    for later_move in range(move + 1, track.shape[0]):
        track[later_move, 0] = track[later_move - period, 0]
        track[later_move, 1] = track[later_move - period, 1]
