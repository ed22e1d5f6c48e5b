"""Lives on a grid as they are looked at: a frame a step, from what lay where and where somebody went."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.parts import Cells


def foraged(side: int, food: npt.NDArray[Any], track: npt.NDArray[Any], visits: str) -> Cells:
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
    return Cells(
        marks={"food": "green"},
        ground=ground.reshape(-1, side, side),
        place=np.stack([cells // side, cells % side], axis=-1),
        heading=heading,
        gained=gained.ravel(),
        visit=np.repeat(np.arange(visit_count), steps),
        visits=visits,
    )
