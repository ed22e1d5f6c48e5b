"""Frames of lifetimes on a grid, one frame per step, for the views of models."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.parts import GridView

# Action at a position that the agent does not reach.
NOT_REACHED: Final = -2
# Quarter turns clockwise from the right.
UP_HEADING: Final = 3
# Change of row and column in a step, by heading.
STEP_BY_HEADING: Final = ((0, 1), (1, 0), (0, -1), (-1, 0))
# Number of columns of a maze, with walls at the edges. Home is in the middle.
MAZE_COLUMNS: Final = 7
HOME_COLUMN: Final = 3
# Kinds of cells in a maze.
WALL: Final = 1
HIGH: Final = 2
LOW: Final = 3


def make_foraging_frames(
    side: int, food: npt.NDArray[Any], track: npt.NDArray[Any], visit_label: str
) -> GridView:
    """Return the frames of visits to a square grid, on which an agent eats the food in its cell.

    - `side`: number of cells per edge.
    - `food` (visits, items): cells with food, numbered row by row.
    - `track` (visits, steps, 2): cell and heading of the agent after each step.
    """
    n_visits, n_steps = track.shape[:2]
    contents = np.zeros((n_visits, n_steps, side * side), np.uint8)
    gained = np.zeros((n_visits, n_steps))
    for visit in range(n_visits):
        contents[visit][:, food[visit]] = 1
        for step, cell in enumerate(track[visit, :, 0]):
            gained[visit, step:] += contents[visit, step, cell]
            contents[visit, step:, cell] = 0
    # The visits follow each other.
    cell, heading = track.reshape(-1, 2).T
    return GridView(
        cell_colors={"food": "green"},
        cells=contents.reshape(-1, side, side),
        position=np.stack([cell // side, cell % side], axis=-1),
        heading=heading,
        gained=gained.ravel(),
        visit=np.repeat(np.arange(n_visits), n_steps),
        visit_label=visit_label,
    )


def make_maze_frames(
    turns: int,
    high_ends: Sequence[int],
    actions: npt.NDArray[Any],
    rewards_at_end: npt.NDArray[Any],
    total_rewards: npt.NDArray[Any],
) -> GridView:
    """Return the frames of trips in T-mazes with one or two turning points between home and an end.

    A corridor connects home, the turning points and the ends.

    - `turns`: number of turning points on the way to an end, 1 or 2.
    - `high_ends`: end with the high reward, by trip. Ends are numbered from left to right, from 0.
    - `actions` (trips, positions): actions at the positions of a trip: corridor, turning point,
      ..., end, corridor, turning point, ..., home. -1 is left, 0 is straight on, 1 is right, or
      NOT_REACHED.
    - `rewards_at_end` (trips,): reward of each trip, shown from the step at the end of the maze.
    - `total_rewards` (trips,): total reward of each trip, shown in its last step.
    """
    paths = [_trace_trip(turns, trip[trip != NOT_REACHED].tolist()) for trip in actions]
    n_frames = [len(path) for path in paths]
    # Position of the end: each turn has a corridor and a turning point before it.
    end_position = 2 * turns
    gained = [
        np.where(np.arange(count) > end_position, reward, 0.0)
        for count, reward in zip(n_frames, rewards_at_end, strict=True)
    ]
    for trip_gained, total_reward in zip(gained, total_rewards, strict=True):
        trip_gained[-1] = total_reward
    mazes = np.stack([_draw_maze(turns, end) for end in range(2**turns)])
    row, column, heading = np.concatenate(paths).T
    return GridView(
        cell_colors={"wall": "edge", "high reward": "green", "low reward": "orange"},
        cells=np.repeat(mazes[high_ends], n_frames, axis=0),
        position=np.stack([row, column], axis=-1),
        heading=heading,
        gained=np.concatenate(gained),
        visit=np.repeat(np.arange(len(paths)), n_frames),
        visit_label="trip",
    )


def _trace_trip(turns: int, actions: Sequence[int]) -> list[tuple[int, int, int]]:
    """Return row, column and heading at home and after each action."""
    row = 2 * turns + 1
    column = HOME_COLUMN
    heading = UP_HEADING
    # Each turn has a corridor and a turning point before the end.
    end_position = 2 * turns
    n_positions_per_way = end_position + 1
    path = [(row, column, heading)]
    for position, action in enumerate(actions):
        if position == n_positions_per_way:
            # The agent turns around at the end.
            heading = (heading + 2) % 4
        # The last corridor before an end or home has no position. The agent does not turn there.
        has_corridor = position % n_positions_per_way == end_position
        n_cells = 2 if has_corridor else 1
        turn = 0 if has_corridor else action
        row += n_cells * STEP_BY_HEADING[heading][0]
        column += n_cells * STEP_BY_HEADING[heading][1]
        heading = (heading + turn) % 4
        path.append((row, column, heading))
    return path


def _draw_maze(turns: int, high: int) -> npt.NDArray[np.uint8]:
    """Return the content of each cell [row, column] if the end `high` has the high reward."""
    paths = []
    for route in product((-1, 1), repeat=turns):
        # Straight on in each corridor and at the end.
        actions = [action for turn in route for action in (0, turn)] + [0]
        paths.append(_trace_trip(turns, actions))
    maze = np.full((2 * turns + 3, MAZE_COLUMNS), WALL, np.uint8)
    steps = [step for path in paths for step in pairwise(path)]
    for (row, column, _), (to_row, to_column, _) in steps:
        maze[
            min(row, to_row) : max(row, to_row) + 1,
            min(column, to_column) : max(column, to_column) + 1,
        ] = 0
    for end, path in enumerate(paths):
        maze[path[-1][:2]] = HIGH if end == high else LOW
    return maze
