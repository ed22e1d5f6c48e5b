"""Lives on a grid as they are looked at: a frame a step, from what lay where and where somebody went."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.parts import GridView

NOT_THERE: Final = -2  # instead of what is done in a place, where somebody does not come
UP: Final = 3
AHEAD: Final = ((0, 1), (1, 0), (0, -1), (-1, 0))  # row and column of a step, by heading
WALL, HIGH, LOW = 1, 2, 3


def foraged(side: int, food: npt.NDArray[Any], track: npt.NDArray[Any], visits: str) -> GridView:
    """Lives on `side` by `side` cells, whose food vanishes, and counts, where somebody stands.

    `food` [visit, item] are cells, row by row; `track` [visit, step, (cell, heading)] is where the agent stands after each step.
    """
    visit_count, steps = track.shape[:2]
    ground = np.zeros((visit_count, steps, side * side), np.uint8)
    gained = np.zeros((visit_count, steps))
    for visit in range(visit_count):
        ground[visit][:, food[visit]] = 1
        for step, cell in enumerate(track[visit, :, 0]):
            gained[visit, step:] += ground[visit, step, cell]
            ground[visit, step:, cell] = 0
    cells, heading = track.reshape(-1, 2).T
    return GridView(
        marks={"food": "green"},
        ground=ground.reshape(-1, side, side),
        place=np.stack([cells // side, cells % side], axis=-1),
        heading=heading,
        gained=gained.ravel(),
        visit=np.repeat(np.arange(visit_count), steps),
        visits=visits,
    )


def in_t_mazes(
    turns: int,
    high: Sequence[int],
    ways: npt.NDArray[Any],
    at_end: npt.NDArray[Any],
    in_all: npt.NDArray[Any],
) -> GridView:
    """Trips into mazes of one or two turning points on the way from home to an end; a corridor lies between any of these.

    `high` [trip] is the end of the high reward: of two, left is 0; of four, those at the left are 0 and 1. `ways` [trip, place]
    say what is done in the places of a trip: corridor, turning point, ..., end, corridor, turning point, ..., home. They are -1
    for left, 0 for straight on, 1 for right, or NOT_THERE. Gained is `at_end` [trip] from the end on, `in_all` in the last step.
    """
    paths = [_path(turns, trip[trip != NOT_THERE].tolist()) for trip in ways]
    steps = [len(path) for path in paths]
    gained = [
        np.where(np.arange(count) > 2 * turns, worth, 0.0)
        for count, worth in zip(steps, at_end, strict=True)
    ]
    for trip, worth in zip(gained, in_all, strict=True):
        trip[-1] = worth
    mazes = np.stack([_t_maze(turns, end) for end in range(2**turns)])
    row, column, heading = np.concatenate(paths).T
    return GridView(
        marks={"wall": "edge", "high reward": "green", "low reward": "orange"},
        ground=np.repeat(mazes[high], steps, axis=0),
        place=np.stack([row, column], axis=-1),
        heading=heading,
        gained=np.concatenate(gained),
        visit=np.repeat(np.arange(len(steps)), steps),
        visits="trip",
    )


def _path(turns: int, ways: Sequence[int]) -> list[tuple[int, int, int]]:
    """Row, column and heading at home, and after what is done in each place."""
    row, column, heading = 2 * turns + 1, 3, UP
    path = [(row, column, heading)]
    for place, way in enumerate(ways):
        if place == 2 * turns + 1:
            heading = (heading + 2) % 4  # at the end it turns round
        # The last corridor on the way to an end, or home, is no place where something is done; nor does it turn there.
        cells, turn = (2, 0) if place % (2 * turns + 1) == 2 * turns else (1, way)
        row, column = row + cells * AHEAD[heading][0], column + cells * AHEAD[heading][1]
        heading = (heading + turn) % 4
        path.append((row, column, heading))
    return path


def _t_maze(turns: int, high: int) -> npt.NDArray[np.uint8]:
    """What lies in each [row, column], where that end has the high reward."""
    paths = [
        _path(turns, [each for turn in turned for each in (0, turn)] + [0])
        for turned in product((-1, 1), repeat=turns)
    ]
    maze = np.full((2 * turns + 3, 7), WALL, np.uint8)
    for (row, column, _), (to_row, to_column, _) in (
        step for path in paths for step in pairwise(path)
    ):
        maze[
            min(row, to_row) : max(row, to_row) + 1,
            min(column, to_column) : max(column, to_column) + 1,
        ] = 0
    for end, path in enumerate(paths):
        maze[path[-1][:2]] = HIGH if end == high else LOW
    return maze
