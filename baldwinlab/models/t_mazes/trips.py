"""Trips of agents in T-mazes, and the change of their synapses."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import clamp

N_INPUTS: Final = 5
TURNING, END, HOME, REWARD, BIAS = range(N_INPUTS)
# Position at which only the bias input is 1.
CORRIDOR: Final = -1
# Number of genes after those of the weights: A, B, C, D and the rate.
N_RULE_GENES: Final = 5
# Limits of a weight and of the rate. A gene is a share of the limit.
MAX_WEIGHT = np.float32(10)
MAX_RATE = np.float32(100)
# Events that are counted.
HIGH, LOW, CRASHES, LOST = range(4)
# Periods after which activations are reset.
STEP, TRIP, LIFETIME = range(3)
ZERO, ONE, TWO, THIRD, LOW_REWARD = (np.float32(number) for number in (0, 1, 2, 1 / 3, 0.2))


@jit_entry_point
def explore(
    numbers: Any, mazes: Any, weights: Any, values: Any, events: Any, counts: Any, actions: Any
) -> None:
    """Simulate the trips of all agents.

    Parameters
    ----------
    numbers : array of shape (7,)
        Number of neurons and of modulatory neurons, whether synapses change, period of the reset of
        activations, number of turning points, whether to return home, and number of trips.
    mazes : array of shape (runs, 3)
        Mazes, as returned by `TMazes.maze`.
    weights : array of shape (runs, agents, weights)
        Weights. They change in place as agents learn.
    values : array of shape (inputs + neurons,)
        Scratch.
    events : array of shape (4,)
        Scratch.
    counts : array of shape (runs, agents, slots, 4)
        Output: the number of events by trip. The last slot has the sum of the remaining trips.
    actions : array of shape (slots, positions)
        Output: the actions of the last simulated agent.
    """
    # An agent without state between trips repeats its actions until the reward moves.
    values[:] = ZERO
    is_stateless = numbers[2] == 0 and numbers[3] != LIFETIME
    for run in range(mazes.shape[0]):
        for agent in range(weights.shape[1]):
            _reset_activations(values)
            for trip in range(numbers[6]):
                slot = min(trip, actions.shape[0] - 1)
                high = high_reward_end(mazes[run], trip)
                if is_stateless and trip > 0 and high == high_reward_end(mazes[run], trip - 1):
                    for position in range(actions.shape[1]):
                        actions[slot, position] = actions[max(slot - 1, 0), position]
                else:
                    if numbers[3] == TRIP:
                        _reset_activations(values)
                    events[:] = 0
                    _make_trip(numbers, high, weights[run, agent], values, events, actions[slot])
                    _choose_action(numbers, weights[run, agent], values, HOME, ZERO)
                for kind in range(events.size):
                    counts[run, agent, slot, kind] += events[kind]


@compiled
def high_reward_end(maze: Any, trip: Any) -> int:
    """Return the end that has the high reward in a trip."""
    return maze[0] if trip < maze[1] else maze[2]  # type: ignore[no-any-return]


@compiled
def _reset_activations(values: Any) -> None:
    for neuron in range(N_INPUTS, values.size):
        values[neuron] = ZERO


@compiled
def _make_trip(
    numbers: Any, high: Any, weights: Any, values: Any, counts: Any, actions: Any
) -> None:
    """Simulate one trip.

    Its positions are a corridor and a turning point for each turn, the end, the same positions on
    the way back, and home.
    """
    out = 2 * numbers[4]
    end = 0
    for position in range(out):
        turning = position % 2
        actions[position] = _choose_action(
            numbers, weights, values, TURNING if turning else CORRIDOR, ZERO
        )
        if (actions[position] != 0) != turning:
            counts[CRASHES] += 1
            return
        if turning:
            end = 2 * end + (actions[position] + 1) // 2
    counts[HIGH if end == high else LOW] += 1
    actions[out] = _choose_action(numbers, weights, values, END, ONE if end == high else LOW_REWARD)
    if numbers[5] == 1:
        for position in range(out + 1, 2 * out + 1):
            turning = 1 - position % 2
            actions[position] = _choose_action(
                numbers, weights, values, TURNING if turning else CORRIDOR, ZERO
            )
            if actions[position] != turning * (1 - 2 * (end & 1)):
                counts[LOST] += 1
                return
            end >>= turning
        actions[2 * out + 1] = 0


@compiled
def _choose_action(numbers: Any, weights: Any, values: Any, position: Any, reward: Any) -> int:
    """Update the network at a position and return the action: 1 right, -1 left, 0 straight on.

    `position` is the index of the input that is 1.
    """
    neurons = numbers[0]
    modulatory = numbers[1]
    for i in range(N_INPUTS):
        values[i] = ONE if i in (position, BIAS) else ZERO
    values[REWARD] = reward
    if numbers[3] == STEP:
        _reset_activations(values)
    for neuron in range(neurons):
        first = neuron * values.size
        sensed = _weighted_sum(weights, first, values, 0, N_INPUTS)
        values[N_INPUTS + neuron] = _activate(
            sensed + _weighted_sum(weights, first, values, N_INPUTS + modulatory, values.size)
        )
    if numbers[2] == 1:
        _update_synapses(neurons, modulatory, weights, values)
    output = values[values.size - 1]
    if output > THIRD:
        return 1
    return -1 if output < -THIRD else 0


@compiled
def _weighted_sum(weights: Any, first: Any, values: Any, begin: Any, end: Any) -> Any:
    """Return the weighted sum of some sources of a neuron whose weights begin at `first`."""
    total = ZERO
    for source in range(begin, end):
        total += weights[first + source] * values[source]
    return total


@compiled
def _activate(total: Any) -> Any:
    """Compute tanh(total / 2)."""
    return TWO * sigmoid(total) - ONE


@compiled
def _update_synapses(neurons: Any, modulatory: Any, weights: Any, values: Any) -> None:
    """Update each synapse from an input or a standard neuron, gated by the modulatory neurons."""
    rule = neurons * values.size
    a = weights[rule]
    b = weights[rule + 1]
    c = weights[rule + 2]
    d = weights[rule + 3]
    rate = weights[rule + 4]
    for neuron in range(neurons):
        first = neuron * values.size
        y = values[N_INPUTS + neuron]
        sent = _weighted_sum(weights, first, values, N_INPUTS, N_INPUTS + modulatory)
        gate = rate * _activate(sent) if modulatory > 0 else rate
        for begin, end in ((0, N_INPUTS), (N_INPUTS + modulatory, values.size)):
            for source in range(begin, end):
                x = values[source]
                weight = weights[first + source] + gate * (a * x * y + b * x + c * y + d)
                weights[first + source] = clamp(weight, MAX_WEIGHT)
