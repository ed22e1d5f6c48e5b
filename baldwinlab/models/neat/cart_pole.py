"""Equations of motion of two poles on a cart that a force moves along a track.

A state has six entries, in m, rad and s: position and velocity of the cart, angle and angular
velocity of the long pole, angle and angular velocity of the short pole. Track, lengths, masses and
steps follow Stanley and Miikkulainen 2002, section 4.3.

References
----------
A. P. Wieland, "Evolving neural network controllers for unstable systems", IJCNN 1991.
Stanley and Miikkulainen 2002.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.arithmetic import polynomial
from baldwinlab.engine.jit import compiled

# Number of entries of a state.
STATE_SIZE: Final = 6
# Indices of the entries of a state.
CART_POSITION, CART_VELOCITY, LONG_ANGLE, LONG_VELOCITY, SHORT_ANGLE, SHORT_VELOCITY = range(6)
# Index of the angle and of the angular velocity of each pole.
ANGLES: Final = (LONG_ANGLE, SHORT_ANGLE)
ANGULAR_VELOCITIES: Final = (LONG_VELOCITY, SHORT_VELOCITY)
# Number of rows of the workspace of `move`: the state, a point, and the slopes at four stages.
WORKSPACE_ROWS: Final = 6
# Limit of the position in both directions, in m.
MAX_POSITION = 2.4
# Limit of the angle in both directions, in rad.
MAX_ANGLE = 36 * np.pi / 180
# Mass of the cart, in kg.
CART_MASS = 1.0
# Masses of the poles, in kg.
POLE_MASSES = (0.1, 0.01)
# Half of the lengths of the poles, in m. The lengths are 1 m and 0.1 m.
POLE_HALF_LENGTHS = (0.5, 0.05)
# Largest force, in N.
MAX_FORCE = 10.0
# Acceleration, in m/s^2.
GRAVITY = -9.8
# Friction coefficient of a hinge.
HINGE_FRICTION = 2e-6
# Time step, in s. The network sets the force once every two steps.
TIME_STEP: Final = 0.01
# Coefficients of the Taylor series of sine and cosine, in powers of the squared angle.
SINE_COEFFICIENTS = tuple(
    (-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 2))) for k in range(9, -1, -1)
)
COSINE_COEFFICIENTS = tuple(
    (-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 1))) for k in range(10, -1, -1)
)


@compiled
def is_balanced(state: Any) -> bool:
    """Return whether the cart is on its track and both poles are upright."""
    is_on_track = abs(state[CART_POSITION]) <= MAX_POSITION
    are_poles_upright = abs(state[LONG_ANGLE]) <= MAX_ANGLE and abs(state[SHORT_ANGLE]) <= MAX_ANGLE
    return bool(is_on_track and are_poles_upright)


@compiled
def move(state: Any, applied_force: float, step: float, friction: float, workspace: Any) -> None:
    """Do one step of the fourth-order Runge-Kutta method.

    `state` is row 0 of `workspace` [6, 6], or another array. The other rows are overwritten.
    """
    point = workspace[1]
    # The derivatives at the four stages of the method.
    slopes = workspace[2:6]
    _compute_slope(state, applied_force, friction, slopes[0])
    for stage in range(1, 4):
        stage_step = step if stage == 3 else 0.5 * step
        for entry in range(STATE_SIZE):
            point[entry] = state[entry] + stage_step * slopes[stage - 1, entry]
        _compute_slope(point, applied_force, friction, slopes[stage])
    for entry in range(STATE_SIZE):
        midpoint_slopes = slopes[1, entry] + slopes[2, entry]
        end_slopes = slopes[0, entry] + slopes[3, entry]
        state[entry] += step / 6.0 * (end_slopes + 2.0 * midpoint_slopes)


@compiled
def _compute_slope(state: Any, applied_force: float, friction: float, slope: Any) -> None:
    """Fill `slope` with the time derivative of a state (Wieland 1991)."""
    force = applied_force
    mass = CART_MASS
    for pole in range(2):
        angle = state[ANGLES[pole]]
        angular_velocity = state[ANGULAR_VELOCITIES[pole]]
        sine = compute_sine(angle)
        cosine = compute_cosine(angle)
        drag = friction * angular_velocity / (POLE_MASSES[pole] * POLE_HALF_LENGTHS[pole])
        force += POLE_MASSES[pole] * (
            POLE_HALF_LENGTHS[pole] * angular_velocity * angular_velocity * sine
            + 0.75 * cosine * (drag + GRAVITY * sine)
        )
        mass += POLE_MASSES[pole] * (1.0 - 0.75 * cosine * cosine)
    slope[CART_POSITION] = state[CART_VELOCITY]
    slope[CART_VELOCITY] = force / mass
    for pole in range(2):
        angle = state[ANGLES[pole]]
        angular_velocity = state[ANGULAR_VELOCITIES[pole]]
        drag = friction * angular_velocity / (POLE_MASSES[pole] * POLE_HALF_LENGTHS[pole])
        slope[ANGLES[pole]] = angular_velocity
        slope[ANGULAR_VELOCITIES[pole]] = (
            -0.75
            / POLE_HALF_LENGTHS[pole]
            * (slope[CART_VELOCITY] * compute_cosine(angle) + GRAVITY * compute_sine(angle) + drag)
        )


@compiled
def compute_sine(angle: float) -> float:
    """Compute the sine of an angle in [-1.5, 1.5], with an error below 1e-15.

    The function uses only products and sums, because the sine of the C library differs between
    machines.
    """
    return angle * polynomial(angle * angle, SINE_COEFFICIENTS)


@compiled
def compute_cosine(angle: float) -> float:
    """Compute the cosine of an angle in [-1.5, 1.5], with an error below 1e-15."""
    return polynomial(angle * angle, COSINE_COEFFICIENTS)
