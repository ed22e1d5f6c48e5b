"""Lifetimes of foragers: visits to successive environments, with learning in each step."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import HALF
from baldwinlab.models.cell_foragers.grid import (
    DRAWS_PER_ENVIRONMENT,
    Visit,
    draw_cell,
    draw_words,
    eat_item,
    execute_action,
    place_food,
    sense_food,
)
from baldwinlab.models.cell_foragers.network import (
    N_ACTION_OUTPUTS,
    N_INPUTS,
    Activations,
    Layers,
    backpropagate,
    compute_outputs,
)
from baldwinlab.parts import unit

# Learning targets, see `CellForagers.learning`.
NO_TARGET: Final = 0
INHERITED_TEACHER: Final = 1
NEXT_SENSATION: Final = 2
NOISE: Final = 3


class ForagingSettings(NamedTuple):
    """Settings that all agents of a generation share."""

    seed: int
    generation: int
    # Number of the first agent.
    first_agent: int
    # Learning target: a constant of this module.
    target: int
    layers: Layers


class Modules(NamedTuple):
    """Weights of the two modules of an agent, float32 [weight] each."""

    action: npt.NDArray[np.float32]
    teaching: npt.NDArray[np.float32]


class EnvironmentPath(NamedTuple):
    """Food and moves of an agent in one environment."""

    # int64 [item]: the cells of the food at the beginning.
    food: npt.NDArray[np.int64]
    # int64 [move, (cell, heading)].
    track: npt.NDArray[np.int64]


class Scratch(NamedTuple):
    """Working memory, which is the same for all agents."""

    # int64 [item]: the cells of the remaining food, or -1.
    food: npt.NDArray[np.int64]
    units: Activations


class ForagingResults(NamedTuple):
    """Results of lifetimes, and the paths in the last simulated environments."""

    # float32 [run, agent, weight]: the action module. It changes in place as agents learn.
    learned: npt.NDArray[np.float32]
    # int32 [run, agent, environment]: number of eaten items.
    eaten: npt.NDArray[np.int32]
    # int64 [environment, item]: the cells of the food.
    food: npt.NDArray[np.int64]
    # int64 [environment, move, (cell, heading)].
    track: npt.NDArray[np.int64]


@jit_entry_point
def simulate_lifetimes(
    settings: ForagingSettings, runs: Any, teaching: Any, scratch: Scratch, results: ForagingResults
) -> None:
    """Simulate the lifetimes of all agents.

    `teaching` (runs, agents, weights): weights of the teaching modules. `results`: output.
    `learned` must have the weights of the action modules at birth.
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
                # The path of a later environment overwrites that of an earlier environment.
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
    # The reference is an earlier move: its number, and the state and eaten items after it.
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
            # An agent without learning repeats its moves if it returns to an earlier state and has
            # eaten no item in between. The state is one number, because action and heading have
            # four values each.
            state = 16 * cell + 4 * heading + action
            if state == reference_state and eaten == reference_eaten:
                _repeat_moves(path.track, move, move - reference_move)
                return eaten
            # The first states may never return. A later state replaces them as the reference.
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
    """Return the action from its two bits. A bit is 1 if its output is above 1/2."""
    # The outputs follow the inputs and the hidden units. The first two are the action.
    first_output = N_INPUTS + layers.hidden
    return 2 * int(values[first_output] > HALF) + int(values[first_output + 1] > HALF)


@compiled
def _learn(
    settings: ForagingSettings, visit: Visit, modules: Modules, units: Activations, move: Any
) -> None:
    """Change the weights of the action module in one step of learning.

    `units.targets` has the next sensation: the angle and the distance of the nearest food.
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
        # The last draws of the environment are not used for food.
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
