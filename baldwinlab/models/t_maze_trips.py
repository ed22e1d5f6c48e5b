"""Trips of the agents of `t_mazes.py`, and changes of synapses in the steps of a trip."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import clamp

N_INPUTS: Final = 5
# Indices of the inputs. The first three are 1 at a turning point, at an end and at home.
TURNING, END, HOME, REWARD, BIAS = range(N_INPUTS)
# This value instead of an index stands for a corridor, where only the bias input is 1.
CORRIDOR: Final = -1
# Number of genes of the learning rule, after the genes of the weights: A, B, C, D and the rate.
N_RULE_GENES: Final = 5
# Largest absolute values of a weight and of the rate.
MAX_WEIGHT = np.float32(10)
MAX_RATE = np.float32(100)
# Indices of the counted events of trips: high reward, low reward, crash, lost on the way home.
HIGH, LOW, CRASHES, LOST = range(4)
# Indices of the settings: number of all neurons, number of modulatory neurons, 1 if synapses
# change, period of the reset of activations, number of turning points, 1 if agents must return
# home, and number of trips.
NEURONS, MODULATORY, PLASTICITY, RESET_PERIOD, TURNING_POINTS, HOMING, TRIPS = range(7)
# Periods after which activations are reset, see `TMazes.memory`.
STEP, TRIP, LIFETIME = range(3)
ZERO, ONE, TWO = (np.float32(number) for number in range(3))
# The agent turns right if the output is above the threshold, left if it is below -threshold.
TURN_THRESHOLD = np.float32(1 / 3)
# Input in which an agent senses the low reward.
LOW_REWARD_INPUT = np.float32(0.2)


@jit_entry_point
def explore(
    settings: Any, mazes: Any, weights: Any, values: Any, events: Any, counts: Any, actions: Any
) -> None:
    """Simulate the trips of all agents.

    The number of slots is the number of trips, or 1. Each trip has its own slot, or all share one.

    - `settings` (7,): in the order of the indices `NEURONS` to `TRIPS`.
    - `mazes` (runs, 3): mazes, as returned by `TMazes.maze`.
    - `weights` (runs, agents, weights): weights, changed in place by learning, then the rule genes.
    - `values` (inputs + neurons,): scratch: activations of inputs and neurons.
    - `events` (4,): scratch: the events of the current trip.
    - `counts` (runs, agents, slots, 4): output: number of events per slot.
    - `actions` (slots, steps): output: action in each step of a trip of the last simulated agent.
    """
    values[:] = ZERO
    # Without learning and without memory between trips, an agent repeats the actions and events of
    # the previous trip while the high reward does not move.
    is_memoryless = settings[PLASTICITY] == 0 and settings[RESET_PERIOD] != LIFETIME
    for run in range(mazes.shape[0]):
        for agent in range(weights.shape[1]):
            _reset_activations(values)
            for trip in range(settings[TRIPS]):
                slot = min(trip, actions.shape[0] - 1)
                high = high_reward_end(mazes[run], trip)
                has_moved = trip == 0 or high != high_reward_end(mazes[run], trip - 1)
                if is_memoryless and not has_moved:
                    # `slot - 1` is the previous trip. With a single slot, the copy has no effect.
                    for position in range(actions.shape[1]):
                        actions[slot, position] = actions[max(slot - 1, 0), position]
                else:
                    if settings[RESET_PERIOD] == TRIP:
                        _reset_activations(values)
                    events[:] = 0
                    _make_trip(settings, high, weights[run, agent], values, events, actions[slot])
                    # At home, the agent only updates neurons and synapses. The action is not used.
                    _choose_action(settings, weights[run, agent], values, HOME, ZERO)
                for kind in range(events.size):
                    counts[run, agent, slot, kind] += events[kind]


@compiled
def high_reward_end(maze: Any, trip: Any) -> int:
    """Return the index of the end with the high reward in a trip. `maze`: see `t_mazes.Maze`."""
    first_end = maze[0]
    change = maze[1]
    second_end = maze[2]
    return first_end if trip < change else second_end  # type: ignore[no-any-return]


@compiled
def _reset_activations(values: Any) -> None:
    for neuron in range(N_INPUTS, values.size):
        values[neuron] = ZERO


@compiled
def _make_trip(
    settings: Any, high: Any, weights: Any, values: Any, counts: Any, actions: Any
) -> None:
    """Simulate one trip. Fill `actions` [step] up to a crash, and add the events to `counts` [4].

    Each way has a step in a corridor and a step at a turning point for each turn. The way out ends
    with a step at the end, the way back with a step at home. `high`: end with the high reward. The
    variable `position` is the index of the step.
    """
    # Number of steps before the end.
    n_outbound = 2 * settings[TURNING_POINTS]
    end = 0
    for position in range(n_outbound):
        is_turning_point = position % 2
        actions[position] = _choose_action(
            settings, weights, values, TURNING if is_turning_point else CORRIDOR, ZERO
        )
        # An agent must go straight on in a corridor, and must turn at a turning point.
        if (actions[position] != 0) != is_turning_point:
            counts[CRASHES] += 1
            return
        if is_turning_point:
            # The index of the end in binary: each turn appends the digit 0 (left) or 1 (right).
            end = 2 * end + (actions[position] + 1) // 2
    counts[HIGH if end == high else LOW] += 1
    actions[n_outbound] = _choose_action(
        settings, weights, values, END, ONE if end == high else LOW_REWARD_INPUT
    )
    if settings[HOMING] == 1:
        for position in range(n_outbound + 1, 2 * n_outbound + 1):
            is_turning_point = 1 - position % 2
            actions[position] = _choose_action(
                settings, weights, values, TURNING if is_turning_point else CORRIDOR, ZERO
            )
            # The last binary digit of `end` is the turn on the way out: 0 left, 1 right. The agent
            # must turn in the opposite direction: action 1 after 0, action -1 after 1.
            return_turn = 1 - 2 * (end & 1)
            required_action = return_turn if is_turning_point else 0
            if actions[position] != required_action:
                counts[LOST] += 1
                return
            if is_turning_point:
                # Remove the digit of this turning point.
                end //= 2
        actions[2 * n_outbound + 1] = 0


@compiled
def _choose_action(settings: Any, weights: Any, values: Any, position: Any, reward: Any) -> int:
    """Update the network in one step and return the action: 1 right, -1 left, 0 straight on.

    `position` is the index of the input that is 1 at the place of the agent: `TURNING`, `END` or
    `HOME`. It is `CORRIDOR` if only the bias is 1. `reward` is the value of the reward input.
    """
    neurons = settings[NEURONS]
    modulatory = settings[MODULATORY]
    for input_index in range(N_INPUTS):
        values[input_index] = ONE if input_index in (position, BIAS) else ZERO
    values[REWARD] = reward
    if settings[RESET_PERIOD] == STEP:
        _reset_activations(values)
    for neuron in range(neurons):
        # Index of the weight from input 0 to this neuron.
        first = neuron * values.size
        from_inputs = _sum_weighted_sources(weights, first, values, 0, N_INPUTS)
        first_standard = N_INPUTS + modulatory
        from_neurons = _sum_weighted_sources(weights, first, values, first_standard, values.size)
        values[N_INPUTS + neuron] = _activate(from_inputs + from_neurons)
    if settings[PLASTICITY] == 1:
        _update_synapses(neurons, modulatory, weights, values)
    # The last neuron is the output.
    output = values[values.size - 1]
    if output > TURN_THRESHOLD:
        return 1
    return -1 if output < -TURN_THRESHOLD else 0


@compiled
def _sum_weighted_sources(weights: Any, first: Any, values: Any, begin: Any, end: Any) -> Any:
    """Return the sum over sources `begin` to `end` - 1, weighted by `weights[first + source]`."""
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
    """Update each synapse from an input or a standard neuron by the rule in `t_mazes.py`."""
    # The learning rule comes after the weights.
    rule = neurons * values.size
    a = weights[rule]
    b = weights[rule + 1]
    c = weights[rule + 2]
    d = weights[rule + 3]
    rate = weights[rule + 4]
    for neuron in range(neurons):
        first = neuron * values.size
        y = values[N_INPUTS + neuron]
        modulation = _sum_weighted_sources(weights, first, values, N_INPUTS, N_INPUTS + modulatory)
        # Without modulatory neurons, the factor tanh(m / 2) of the rate is 1.
        gate = rate * _activate(modulation) if modulatory > 0 else rate
        for begin, end in ((0, N_INPUTS), (N_INPUTS + modulatory, values.size)):
            for source in range(begin, end):
                x = values[source]
                weight = weights[first + source] + gate * (a * x * y + b * x + c * y + d)
                weights[first + source] = clamp(weight, MAX_WEIGHT)
