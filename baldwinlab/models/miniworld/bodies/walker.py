"""The body of the paper: an agent that turns and moves forward.

Source: Le (2019), "The Simulated World of Foods and Agents".
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import ONE, TWO, ZERO, Lane, Value, choose, get, lookup, put
from baldwinlab.models.miniworld.map import wrap_position
from baldwinlab.models.miniworld.state import HEADING_COUNT, STRIDE, MiniWorldModel, State
from baldwinlab.parts.bodies import Body

N_HEADINGS = np.float32(HEADING_COUNT)
LAST_HEADING = np.float32(HEADING_COUNT - 1)


@compiled
def move_along(
    model: MiniWorldModel, state: State, heading: Value, speed: Value, lane: Lane
) -> None:
    """Set the heading, and move by `speed` in its direction.

    `heading` is a number of headings. It can be out of range by at most a complete turn.
    """
    heading = choose(heading < ZERO, heading + N_HEADINGS, heading)
    heading = choose(heading > LAST_HEADING, heading - N_HEADINGS, heading)
    x = get(state.positions, 0, lane) + speed * lookup(model.cosine, heading)
    y = get(state.positions, 1, lane) + speed * lookup(model.sine, heading)
    put(state.positions, 0, lane, wrap_position(x, model.width))
    put(state.positions, 1, lane, wrap_position(y, model.height))
    put(state.heading, 0, lane, heading)


class Walker(Body, name="walker"):
    """Three actions: turn left, go forward, turn right.

    A turn is a rotation by 9 degrees, and a move by 1. Going forward is a move by 2.

    References
    ----------
    Le 2019.
    """

    actions: ClassVar[tuple[str, ...]] = ("left", "forward", "right")
    stride: ClassVar[float] = STRIDE

    @staticmethod
    def choose_action(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        """Choose the action with the largest output. A tie goes to the lowest index."""
        rows = state.activations.shape[0]
        left = get(state.activations, rows - 3, lane)
        forward = get(state.activations, rows - 2, lane)
        right = get(state.activations, rows - 1, lane)
        action = choose(forward > left, ONE, ZERO)
        put(state.action, 0, lane, choose((right > left) & (right > forward), TWO, action))

    @staticmethod
    def move(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        """Turn left for action 0 and right for action 2, then move."""
        action = get(state.action, 0, lane)
        turn = action - ONE
        is_forward = (action > ZERO) & (action < TWO)
        speed = choose(is_forward, TWO, ONE)
        move_along(model, state, get(state.heading, 0, lane) + turn, speed, lane)
