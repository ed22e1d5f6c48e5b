"""Balance of two poles on a cart by networks, in compiled code. `neat_poles.py` calls `balance`.

A force moves the cart along a track. A state has six entries: position (m) and velocity (m/s) of
the cart, angle (rad) and angular velocity (rad/s) of the long pole, angle and angular velocity of
the short pole. Track, lengths, masses and steps follow Stanley and Miikkulainen 2002, section 4.3.

References
----------
A. P. Wieland, "Evolving neural network controllers for unstable systems", IJCNN 1991.
Stanley and Miikkulainen 2002.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import polynomial, sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.evolution.neat.genome import list_links
from baldwinlab.models.neat_networks import N_OUTPUTS

# Number of entries of a state.
STATE_SIZE: Final = 6
# Indices of the entries of a state.
CART_POSITION, CART_VELOCITY, LONG_ANGLE, LONG_VELOCITY, SHORT_ANGLE, SHORT_VELOCITY = range(6)
# Indices of the angles and of the angular velocities: long pole, short pole.
ANGLES: Final = (LONG_ANGLE, SHORT_ANGLE)
ANGULAR_VELOCITIES: Final = (LONG_VELOCITY, SHORT_VELOCITY)
# Number of rows of the workspace of `move`: state, intermediate state, derivatives at four stages.
WORKSPACE_ROWS: Final = 6
# Limit of the position in both directions, in m.
MAX_POSITION = 2.4
# Limit of the angle in both directions, in rad.
MAX_ANGLE = 36 * np.pi / 180
# Mass of the cart, in kg.
CART_MASS = 1.0
# Masses of the poles, in kg.
POLE_MASSES = (0.1, 0.01)
# Half of the lengths of the poles, in m: the long pole has 1 m, the short pole 0.1 m.
POLE_HALF_LENGTHS = (0.5, 0.05)
# Largest force, in N.
MAX_FORCE = 10.0
# Gravitational acceleration, in m/s^2. It is negative, as in Wieland's equations.
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
    """Change `state` by one step of the fourth-order Runge-Kutta method.

    `workspace` [6, 6]: `state` can be row 0. The other rows are overwritten.
    """
    point = workspace[1]
    # [stage, entry]: the derivatives at the four stages of the method.
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
    """Fill `slope` [entry] with the time derivative of a state (Wieland 1991)."""
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

    The function is a polynomial, because the sine of the C library differs between machines.
    """
    return angle * polynomial(angle * angle, SINE_COEFFICIENTS)


@compiled
def compute_cosine(angle: float) -> float:
    """Compute the cosine of an angle in [-1.5, 1.5], with an error below 1e-15."""
    return polynomial(angle * angle, COSINE_COEFFICIENTS)


# Divisor of each entry of a state. The quotient is the input of a network.
INPUT_SCALES: Final = (4.8, 2.0, 0.52, 2.0, 0.52, 2.0)
# Number of last steps of a trial over which the unrest is added up, see `BalanceResults`.
N_UNREST_STEPS: Final = 100
# A link has three entries: the rows of its source and its target, and its weight.
LINK_SOURCE, LINK_TARGET, LINK_WEIGHT = range(3)
LINK_SIZE: Final = 3


class BalanceSettings(NamedTuple):
    """Settings that are the same for all networks."""

    # Indices of the entries of a state that the network senses.
    sensed_entries: npt.NDArray[np.int64]
    # Whether networks may be recurrent.
    has_loops: bool
    max_steps: int
    sigmoid_slope: np.float32


class BalanceScratch(NamedTuple):
    """Arrays that are used again for each network."""

    # [2, node]: values of nodes (0), and the values that links of recurrent networks read (1).
    values: npt.NDArray[np.float32]
    # [2, link, (source, target, weight)]: links in the order of the genome (0), and in the order of
    # evaluation (1).
    links: npt.NDArray[np.float32]
    # [6, entry]: the state, and rows for `move`.
    workspace: npt.NDArray[np.float64]
    # [step modulo `N_UNREST_STEPS`]: unrest in the last steps.
    recent_unrest: npt.NDArray[np.float64]


class BalanceResults(NamedTuple):
    """Results of all networks from all initial states, as arrays [run, agent, state]."""

    # Number of steps until the cart leaves its track or a pole falls.
    n_steps: npt.NDArray[np.int64]
    # Sum over the last `N_UNREST_STEPS` steps of |position| + |velocity| of the cart + |angle| +
    # |angular velocity| of the long pole.
    unrest: npt.NDArray[np.float64]


@jit_entry_point
def balance(
    settings: BalanceSettings,
    graphs: Any,
    initial_states: Any,
    scratch: BalanceScratch,
    results: BalanceResults,
) -> None:
    """Balance the poles with all networks from all initial states.

    - `graphs`: (runs, agents, entries).
    - `initial_states`: (states, 6).
    - `results`: output.
    """
    n_inputs = settings.sensed_entries.size
    unordered_links = scratch.links[0]
    ordered_links = scratch.links[1]
    for run in range(graphs.shape[0]):
        for agent in range(graphs.shape[1]):
            n_links = order_links(
                graphs[run, agent],
                n_inputs,
                settings.has_loops,
                unordered_links,
                ordered_links,
                scratch.values[1],
            )
            for state_index in range(initial_states.shape[0]):
                _init_trial(initial_states[state_index], settings.has_loops, scratch)
                n_steps = _balance_once(settings, ordered_links, n_links, scratch)
                results.n_steps[run, agent, state_index] = n_steps
                total_unrest = 0.0
                for step in range(N_UNREST_STEPS):
                    total_unrest += scratch.recent_unrest[step]
                results.unrest[run, agent, state_index] = total_unrest


@compiled
def _init_trial(initial_state: Any, has_loops: bool, scratch: BalanceScratch) -> None:
    """Set the initial state and the initial values of nodes: 0 in recurrent networks, else 1/2.

    A node without incoming links keeps the initial value.
    """
    state = scratch.workspace[0]
    for entry in range(STATE_SIZE):
        state[entry] = initial_state[entry]
    initial_value = np.float32(0) if has_loops else np.float32(0.5)
    for node in range(scratch.values.shape[1]):
        scratch.values[0, node] = initial_value
        scratch.values[1, node] = initial_value
    for step in range(N_UNREST_STEPS):
        scratch.recent_unrest[step] = 0.0


@compiled
def _balance_once(
    settings: BalanceSettings, ordered_links: Any, n_links: int, scratch: BalanceScratch
) -> int:
    """Return the number of steps until the cart leaves its track or a pole falls."""
    state = scratch.workspace[0]
    values = scratch.values[0]
    # In recurrent networks, links read the values of the previous step from a separate array.
    sources = scratch.values[1 if settings.has_loops else 0]
    step = 0
    while step < settings.max_steps and is_balanced(state):
        output = activate_once(
            ordered_links,
            n_links,
            settings.sigmoid_slope,
            settings.sensed_entries,
            state,
            sources,
            values,
        )
        # The output, from 0 to 1, sets the force from -MAX_FORCE to MAX_FORCE.
        applied_force = MAX_FORCE * (2.0 * np.float64(output) - 1.0)
        if settings.has_loops:
            for node in range(values.size):
                sources[node] = values[node]
        # Two time steps of 0.01 s for each output of the network.
        move(state, applied_force, TIME_STEP, HINGE_FRICTION, scratch.workspace)
        move(state, applied_force, TIME_STEP, HINGE_FRICTION, scratch.workspace)
        if is_balanced(state):
            # Rounding depends on the order of additions. Two separate sums fix this order.
            cart_unrest = abs(state[CART_POSITION]) + abs(state[CART_VELOCITY])
            pole_unrest = abs(state[LONG_ANGLE]) + abs(state[LONG_VELOCITY])
            # A new step overwrites the entry of the step `N_UNREST_STEPS` earlier.
            scratch.recent_unrest[step % N_UNREST_STEPS] = cart_unrest + pole_unrest
            step += 1
    return step


@compiled
def order_links(
    graph: Any,
    n_inputs: int,
    has_loops: bool,
    unordered_links: Any,
    ordered_links: Any,
    is_ordered: Any,
) -> int:
    """Copy the enabled links in the order of evaluation, and return the number of copied links.

    Without loops, a link comes after all links to its source node. All links to one node are
    adjacent, in the order of the genome. Rows are indices of `BalanceScratch.values`.

    - `graph` (entries,): the network.
    - `n_inputs`: number of inputs without the bias.
    - `has_loops`: whether networks may be recurrent.
    - `unordered_links` (links, 3): scratch.
    - `ordered_links` (links, 3): output: source row, target row and weight of each link.
    - `is_ordered` (rows,): scratch: 1 for inputs and for nodes whose links are copied, else 0.
    """
    n_links = list_links(graph, n_inputs, N_OUTPUTS, is_ordered.size, unordered_links)
    n_ordered = 0
    has_changed = True
    for row in range(is_ordered.size):
        is_ordered[row] = 1.0 if row < n_inputs else 0.0
    while has_changed:
        has_changed = False
        for row in range(n_inputs, is_ordered.size):
            if is_ordered[row] > 0.0:
                continue
            if has_loops or _has_ordered_sources(unordered_links, n_links, row, is_ordered):
                is_ordered[row] = 1.0
                has_changed = True
                for link in range(n_links):
                    if unordered_links[link, LINK_TARGET] == row:
                        for column in range(LINK_SIZE):
                            ordered_links[n_ordered, column] = unordered_links[link, column]
                        n_ordered += 1
    return n_ordered


@compiled
def _has_ordered_sources(unordered_links: Any, n_links: int, row: int, is_ordered: Any) -> bool:
    """Return whether `is_ordered` is 1 for all source nodes of the node `row`."""
    has_ordered_sources = True
    for link in range(n_links):
        source = int(unordered_links[link, LINK_SOURCE])
        # The row of the bias is -1.
        if unordered_links[link, LINK_TARGET] == row and source >= 0:
            has_ordered_sources = has_ordered_sources and is_ordered[source] > 0.0
    return has_ordered_sources


@compiled
def activate_once(
    ordered_links: Any,
    n_links: int,
    sigmoid_slope: Any,
    sensed_entries: Any,
    state: Any,
    sources: Any,
    values: Any,
) -> Any:
    """Update `values` [row] of all nodes with incoming links, and return the output, in (0, 1).

    Links read the values of source nodes from `sources` [row]. In feed-forward networks, `sources`
    is the array `values`. In recurrent networks, `sources` has the values of the previous step and
    the current inputs. A source of -1 is the bias, which is 1.
    """
    for row in range(sensed_entries.size):
        entry = sensed_entries[row]
        scaled_input = np.float32(state[entry] / INPUT_SCALES[entry])
        sources[row] = scaled_input
        values[row] = scaled_input
    link = 0
    # Links to the same node are adjacent, so the inner loop updates one node.
    while link < n_links:
        target = int(ordered_links[link, LINK_TARGET])
        total = np.float32(0)
        while link < n_links and int(ordered_links[link, LINK_TARGET]) == target:
            source = int(ordered_links[link, LINK_SOURCE])
            source_value = np.float32(1) if source < 0 else sources[source]
            total += ordered_links[link, LINK_WEIGHT] * source_value
            link += 1
        values[target] = sigmoid(sigmoid_slope * total)
    # The last value is the output.
    return values[values.size - 1]
