"""Grid of cells with food, and the actions of an agent on it."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.engine.arithmetic import share_of_turn
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import ONE, ZERO, square_root
from baldwinlab.parts import LIFE, philox, unit

# Number of cells per edge.
GRID_SIZE: Final = 10
# Number of items.
N_FOOD_ITEMS: Final = 10
# Actions. Any other action is to stay.
TURN_RIGHT: Final = 1
TURN_LEFT: Final = 2
GO_AHEAD: Final = 3
# Number of random draws that are reserved for an environment.
DRAWS_PER_ENVIRONMENT: Final = 4096
# Distance between opposite corners, in cells.
MAX_DISTANCE: Final = np.float32(GRID_SIZE - 1) * np.float32(1.4142135)


class Visit(NamedTuple):
    """Key of the random numbers of an agent in one environment."""

    seed: int
    run: int
    generation: int
    agent: int
    # Number of the first draw of the environment.
    first_draw: int


@compiled
def draw_words(visit: Visit, draw_index: Any) -> Any:
    """Return the random words of a draw of a visit. The draws are counted from 0."""
    return philox(
        visit.first_draw + draw_index, visit.agent, visit.generation, LIFE, visit.seed, visit.run
    )


@compiled
def draw_cell(word: Any) -> int:
    """Return a cell from a random word. Cells are numbered row by row."""
    return int(unit(word) * np.float32(GRID_SIZE * GRID_SIZE))


@compiled
def place_food(food: Any, visit: Visit) -> None:
    """Draw a different cell for each item. An occupied cell is drawn again."""
    # Draw 0 has the initial cell and heading of the agent.
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

    The angle is clockwise from the heading, as a share of a turn. The distance is a share of the
    largest distance.
    """
    # A squared distance above all squared distances on the grid.
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
    # Rotate the offset by quarter turns, so that the heading is to the right.
    for _ in range(heading):
        nearest_dx, nearest_dy = nearest_dy, -nearest_dx
    angle = share_of_turn(np.float32(nearest_dx), np.float32(nearest_dy))
    distance = square_root(np.float32(nearest_squared)) / MAX_DISTANCE
    return angle, distance


@compiled
def execute_action(action: Any, cell: Any, heading: Any) -> Any:
    """Return the cell and the heading after an action: stay, turn right, turn left or go ahead."""
    if action == TURN_RIGHT:
        return cell, (heading + 1) % 4
    if action == TURN_LEFT:
        return cell, (heading + 3) % 4
    if action == GO_AHEAD:
        # Headings are quarter turns clockwise from the right: right, down, left, up.
        x = cell % GRID_SIZE + int(heading == 0) - int(heading == 2)
        y = cell // GRID_SIZE + int(heading == 1) - int(heading == 3)
        if 0 <= x < GRID_SIZE and 0 <= y < GRID_SIZE:
            return y * GRID_SIZE + x, heading
    return cell, heading


@compiled
def eat_item(food: Any, cell: Any) -> int:
    """Remove the food in a cell. Return the number of eaten items."""
    n_eaten = 0
    for item in range(food.size):
        if food[item] == cell:
            food[item] = -1
            n_eaten = 1
    return n_eaten
