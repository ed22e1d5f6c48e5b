"""Bodies: the walker of the paper, a walker that can stay, a body on a grid, and two wheels.

The walker is that of Le (2019), "The Simulated World of Foods and Agents". All bodies move by at
most `STRIDE` in a step.

The lengths of moves and the angles of turns of the other bodies are our interpretation. Sources:

- Stay: S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks",
  Adaptive Behavior 3 (1994). Their organisms go ahead, turn left or right, or do nothing.
- Four directions: D. Ackley and M. Littman, "Interactions between learning and evolution",
  Artificial Life II (1991).
- Wheels with the outputs of the network as speeds: S. Nolfi and D. Floreano, Evolutionary
  Robotics (2000), on the Khepera robot.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field

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
    """Set the heading, and move by `speed` in this direction.

    `heading` is in turns of 9 degrees, and can be outside [0, 40) by at most a complete turn.
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


MAX_SPEED = np.float32(STRIDE)
HEADINGS_PER_QUARTER = np.float32(HEADING_COUNT // 4)
# Degrees between two neighboring headings.
DEGREES_PER_HEADING = np.float32(360 / HEADING_COUNT)
# Adding and subtracting this constant rounds to the nearest integer, and ties to even.
ROUNDING = np.float32(1.5 * 2**23)


class Stay(Body, name="stay"):
    """Four actions: turn left, go forward, turn right, stay.

    The first three are the actions of `walker`.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    actions: ClassVar[tuple[str, ...]] = ("left", "forward", "right", "stay")
    stride: ClassVar[float] = STRIDE

    @staticmethod
    def move(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        action = get(state.action, 0, lane)
        turn = choose(action > TWO, ZERO, action - ONE)
        is_forward = (action > ZERO) & (action < TWO)
        is_stay = action > TWO
        speed = choose(is_forward, TWO, choose(is_stay, ZERO, ONE))
        move_along(model, state, get(state.heading, 0, lane) + turn, speed, lane)


class Grid(Body, name="grid"):
    """Four actions: move by 2 to the right, down, left or up, and head in this direction.

    References
    ----------
    Ackley and Littman 1991.
    """

    actions: ClassVar[tuple[str, ...]] = ("right", "down", "left", "up")
    stride: ClassVar[float] = STRIDE

    @staticmethod
    def move(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        move_along(model, state, get(state.action, 0, lane) * HEADINGS_PER_QUARTER, MAX_SPEED, lane)


class Continuous(Body, name="continuous"):
    """Two wheels whose speeds are the two outputs.

    The agent moves by the sum of the outputs, 0 to 2.
    The agent turns toward the slower wheel by `max_turn` times the difference, rounded to
    multiples of 9 degrees.
    The recorded action is the index of the faster wheel.
    The setting `motor.noise` must be 0.

    References
    ----------
    Nolfi and Floreano 2000 (Khepera robot).
    """

    max_turn: float = Field(
        36.0,
        ge=0,
        le=180,
        description=("Turn in degrees if one wheel has full speed and the other does not move."),
    )
    actions: ClassVar[tuple[str, ...]] = ("left wheel", "right wheel")
    stride: ClassVar[float] = STRIDE
    chooses: ClassVar[bool] = False

    def check(self, experiment: Any) -> None:
        if experiment.motor.noise > 0:
            raise ValueError(
                "motor.noise must be 0 with motor.body = 'continuous', "
                "which does not choose an action"
            )

    @staticmethod
    def move(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        rows = state.activations.shape[0]
        left = get(state.activations, rows - 2, lane)
        right = get(state.activations, rows - 1, lane)
        turn = ((left - right) * (part.max_turn / DEGREES_PER_HEADING) + ROUNDING) - ROUNDING
        move_along(model, state, get(state.heading, 0, lane) + turn, left + right, lane)
