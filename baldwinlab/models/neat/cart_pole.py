"""Two poles of different lengths, hinged on a cart that a force pushes along a track: how they move.

A state is [place, velocity of the cart, angle, angular velocity of the long pole, the same of the short one], in m, rad and s.

Sources: A. P. Wieland, "Evolving neural network controllers for unstable systems", IJCNN 1991, for the equations of motion;
Stanley and Miikkulainen 2002, section 4.3, for track, lengths, masses and steps.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.arithmetic import polynomial
from baldwinlab.engine.jit import compiled

PARTS: Final = 6  # of a state
TRACK, UPRIGHT = 2.4, 36 * np.pi / 180  # m either way; rad either way
CART, MASSES, HALVES = (
    1.0,
    (0.1, 0.01),
    (0.5, 0.05),
)  # kg, kg, and half of the lengths in m: 1 m and 0.1 m
FORCE, GRAVITY, HINGE = 10.0, -9.8, 2e-6  # N, m/s^2, friction of a hinge
STEP: Final = 0.01  # s, of which there are two to a push
SINE = tuple(
    (-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 2))) for k in range(9, -1, -1)
)  # in powers of the square
COSINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 1))) for k in range(10, -1, -1))


@compiled
def stands(state: Any) -> bool:
    """Whether the cart is on its track and both poles are upright."""
    return bool(abs(state[0]) <= TRACK and abs(state[2]) <= UPRIGHT and abs(state[4]) <= UPRIGHT)


@compiled
def move(state: Any, push: float, step: float, friction: float, motion: Any) -> None:
    """One step of Runge and Kutta's fourth order. `motion` [7, 6] is scratch from row 1 on."""
    point = motion[1]
    _slope(state, push, friction, motion[2])
    for stage in range(1, 4):
        share = step if stage == 3 else 0.5 * step
        for part in range(PARTS):
            point[part] = state[part] + share * motion[1 + stage, part]
        _slope(point, push, friction, motion[2 + stage])
    for part in range(PARTS):
        inner = motion[3, part] + motion[4, part]
        state[part] += step / 6.0 * ((motion[2, part] + motion[5, part]) + 2.0 * inner)


@compiled
def _slope(state: Any, push: float, friction: float, slope: Any) -> None:
    """The rates at which cart and poles change (Wieland 1991)."""
    force, mass = push, CART
    for pole in range(2):
        angle, turning = state[2 + 2 * pole], state[3 + 2 * pole]
        sine, cosine = sine_of(angle), cosine_of(angle)
        drag = friction * turning / (MASSES[pole] * HALVES[pole])
        force += MASSES[pole] * (
            HALVES[pole] * turning * turning * sine + 0.75 * cosine * (drag + GRAVITY * sine)
        )
        mass += MASSES[pole] * (1.0 - 0.75 * cosine * cosine)
    slope[0], slope[1] = state[1], force / mass
    for pole in range(2):
        angle, turning = state[2 + 2 * pole], state[3 + 2 * pole]
        drag = friction * turning / (MASSES[pole] * HALVES[pole])
        slope[2 + 2 * pole] = turning
        slope[3 + 2 * pole] = (
            -0.75 / HALVES[pole] * (slope[1] * cosine_of(angle) + GRAVITY * sine_of(angle) + drag)
        )


@compiled
def sine_of(angle: float) -> float:
    """Of an angle between -1.5 and 1.5, within 1e-15: products alone, so that the bits are those of any machine."""
    return angle * polynomial(angle * angle, SINE)


@compiled
def cosine_of(angle: float) -> float:
    """Of an angle between -1.5 and 1.5, within 1e-15."""
    return polynomial(angle * angle, COSINE)
