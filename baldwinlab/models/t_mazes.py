"""T-mazes in which the high reward moves, and networks whose synapses change during life.

    baldwinlab reproduce soltoggio-2008

A lifetime is a hundred trips. A trip goes from home along a corridor to a turning point, then left
or right, to an end of the maze. In the double maze, a trip passes two turning points. One end has a
reward of 1, the other ends have 0.2. The high reward moves once in a lifetime, near its middle. The
agent goes straight on if the output is within 1/3 of 0, otherwise right or left. A wrong action in
a corridor or at a turning point is a crash, which costs 0.4 and ends the trip. With `homing`, the
agent must also return home. Otherwise it loses 0.3.

Four inputs are 1 at a turning point, at an end, at home, and always. The fifth is the reward. The
activation of a neuron is tanh(a / 2), where a is the sum over inputs and the last values of
standard neurons. The modulatory neurons are updated first, then the standard neurons, the output
last. After each step, each synapse from an input or a standard neuron with the activation x to a
neuron with the activation y changes by

    tanh(m / 2) rate (A x y + B x + C y + D)

where m is the sum of the signals that the neuron receives from modulatory neurons. Without
modulatory neurons, the factor tanh(m / 2) is 1. Weights are limited to [-10, 10].

The rule, the rewards and the trips are from memory. Our choices are as follows. The number of
neurons is given and all neurons are connected; in the paper, neurons are inserted, duplicated and
deleted. Synapses of modulatory neurons do not change. Activations last for a trip (`memory`), so
only weights carry information between trips. A position takes one step. All agents of a generation
of a run have the same maze.

References
----------
A. Soltoggio, J. A. Bullinaria, C. Mattiussi, P. Duerr and D. Floreano, "Evolutionary advantages of
neuromodulated plasticity in dynamic, reward-based scenarios", ALIFE XI (2008).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import clamp
from baldwinlab.models.grid_frames import NOT_REACHED, in_t_mazes
from baldwinlab.parts import (
    FOUNDER,
    LIFE,
    OF_AGENT,
    Field,
    GridView,
    LifeResults,
    Model,
    PathView,
    Variable,
    View,
    uniforms,
)

INPUTS: Final = 5
TURNING, END, HOME, REWARD, BIAS = range(INPUTS)
# Position at which only the bias input is 1.
CORRIDOR: Final = -1
# Number of genes after those of the weights: A, B, C, D and the rate.
RULE: Final = 5
# Limits of a weight and of the rate. A gene is a share of the limit.
WEIGHT = np.float32(10)
RATE = np.float32(100)
# Events that are counted.
HIGH, LOW, CRASHES, LOST = range(4)
# Periods after which activations are reset.
STEP, TRIP, LIFETIME = range(3)
RESET_PERIODS: Final = {"step": STEP, "trip": TRIP, "life": LIFETIME}
# Maximum number of trips in a view.
MAX_SHOWN_TRIPS: Final = 1000
ZERO, ONE, TWO, THIRD, SMALL = (np.float32(number) for number in (0, 1, 2, 1 / 3, 0.2))


class MazeResults(NamedTuple):
    """Results of lifetimes, and the actions of the last trips."""

    # [run, agent, weight]: the genes at death.
    learned: npt.NDArray[np.float32]
    # [run, agent, slot, 4]: the events of each trip, or of all trips if there is one slot.
    counts: npt.NDArray[np.int64]
    # [slot, position] of one agent: -1 left, 0 straight on, 1 right, or NOT_REACHED.
    actions: npt.NDArray[np.int64]


def total_reward(counts: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """Return the total reward of trips from the counts of their events [..., 4]."""
    high, low, crashes, lost = np.moveaxis(counts, -1, 0)
    reward: npt.NDArray[np.float64] = high + 0.2 * low - 0.4 * crashes - 0.3 * lost
    return reward


def _trips(model: TMazes, key: Any, genomes: npt.NDArray[np.float32], agent: int) -> GridView:
    trips = min(model.trips, MAX_SHOWN_TRIPS)
    results = model.explore(
        key.seed, [key.run], key.generation, genomes[None, [agent]], trips, trips
    )
    maze = model.maze(key.seed, key.run, key.generation)
    high = [high_reward_end(maze, trip) for trip in range(trips)]
    counts = results.counts[0, 0]
    return in_t_mazes(
        model.turning_points,
        high,
        results.actions,
        total_reward(counts * [1, 1, 0, 0]),
        total_reward(counts),
    )


def _returns(model: TMazes, key: Any, genomes: npt.NDArray[np.float32], agent: int) -> PathView:
    trips = min(model.trips, MAX_SHOWN_TRIPS)
    counts = model.explore(key.seed, [key.run], key.generation, genomes[None], trips, trips).counts[
        0
    ]
    returns = np.pad(total_reward(counts.cumsum(axis=1)), ((0, 0), (1, 0)))
    lines = {
        f"agent {agent}": returns[agent],
        "average of all": returns.mean(axis=0),
        "best of all": returns.max(axis=0),
    }
    return PathView(lines, "trip", "reward gained until then")


class TMazes(Model, name="t-mazes"):
    """Networks that learn in which arm of a T-maze the high reward is."""

    turning_points: Literal[1, 2] = Field(
        1,
        description=(
            "Number of turning points on the way to an end. 1: single maze; 2: double maze."
        ),
    )
    homing: bool = Field(
        False,
        description=(
            "Whether the agent must return home. Otherwise a trip ends at the end of the maze."
        ),
    )
    trips: int = Field(100, ge=4, le=100_000, description="Number of trips in a lifetime.")
    standard_neurons: int = Field(
        3, ge=0, le=50, description="Number of standard neurons, without the output."
    )
    modulatory_neurons: int = Field(
        1, ge=0, le=50, description="Number of modulatory neurons. 0: plasticity is not modulated."
    )
    plasticity: bool = Field(True, description="Whether synapses change during life.")
    memory: Literal["step", "trip", "life"] = Field(
        "trip", description="Period after which activations are reset to 0."
    )

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 200},
        "evolution": {
            "generations": 201,
            "selection": "larger-tournament",
            "variation": "gaussian",
            "mutation_rate": 0.03,
            "mutation_size": 0.5,
        },
        "record": {"genome_every": 10},
    }
    payoff: ClassVar[str] = "reward gained in a lifetime"
    records: ClassVar[Mapping[str, Variable]] = {
        "high": Variable(OF_AGENT, np.float32, "1", "share of trips that reach the high reward"),
        "crashed": Variable(OF_AGENT, np.float32, "1", "share of trips that end in a crash"),
    }
    views: ClassVar[Mapping[str, View]] = {
        "trips": View(
            "An agent in its maze, cell by cell, for each trip. After a crash it "
            "faces the wall. The position of the high reward, and its change, are "
            "drawn for each generation.",
            _trips,
        ),
        "returns": View(
            (
                "Gain of an agent after each trip, compared with the average and the best"
                " of its generation."
            ),
            _returns,
        ),
    }

    @property
    def learns(self) -> bool:
        return self.plasticity

    @property
    def steps(self) -> int:
        """Return the number of positions of all trips without a crash, home included."""
        return self.trips * (2 * self.turning_points * (2 if self.homing else 1) + 2)

    def without_learning(self) -> TMazes:
        return self.model_copy(update={"plasticity": False})

    @property
    def neurons(self) -> int:
        return self.modulatory_neurons + self.standard_neurons + 1

    def weights(self) -> int:
        return self.neurons * (INPUTS + self.neurons) + RULE

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        draws = key.uniforms(FOUNDER, (agents, self.weights()))[:, None, :, 0]
        drawn: npt.NDArray[np.float32] = (2 * draws - 1).astype(np.float32)
        return drawn

    def maze(self, seed: int, run: int, generation: int) -> tuple[int, int, int]:
        """Draw the maze of a generation.

        Returns
        -------
        first_end : int
            End that has the high reward first. Ends are numbered from 0.
        change : int
            Trip before which the high reward moves.
        second_end : int
            End to which the high reward moves.
        """
        first_draw, change_draw, second_draw, _ = uniforms(seed, run, generation, LIFE, (1, 1))[
            0, 0
        ]
        ends = 2**self.turning_points
        first_end = int(first_draw * ends)
        earliest = self.trips * 35 // 100
        latest = self.trips * 65 // 100
        change = earliest + int(change_draw * (latest - earliest + 1))
        second_end = (first_end + 1 + int(second_draw * (ends - 1))) % ends
        return first_end, change, second_end

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        learned, counts, _ = self.explore(seed, runs, generation, genomes, self.trips, 1)
        energy = total_reward(counts[:, :, 0])
        shares = {"high": counts[..., 0, HIGH], "crashed": counts[..., 0, CRASHES]}
        records = {name: (count / self.trips).astype(np.float32) for name, count in shares.items()}
        return LifeResults(energy, np.zeros_like(energy), learned, records)

    def explore(
        self,
        seed: int,
        runs: Sequence[int],
        generation: int,
        genomes: npt.NDArray[np.float32],
        trips: int,
        slots: int,
    ) -> MazeResults:
        """Simulate the first `trips` trips of lifetimes, with the results of `slots` single trips.

        The last slot has the sum of the remaining trips.
        """
        sizes = np.full(self.weights(), WEIGHT)
        sizes[-RULE:] = 1, 1, 1, 1, RATE
        weights = np.clip(genomes[:, :, 0], -ONE, ONE) * sizes
        network = self.neurons, self.modulatory_neurons, self.plasticity, RESET_PERIODS[self.memory]
        numbers = np.array([*network, self.turning_points, self.homing, trips])
        mazes = np.array([self.maze(seed, run, generation) for run in runs])
        counts = np.zeros((*genomes.shape[:2], slots, 4), np.int64)
        actions = np.full((slots, 4 * self.turning_points + 2), NOT_REACHED, np.int64)
        scratch = poison.empty(INPUTS + self.neurons, np.float32), poison.empty(4, np.int64)
        explore(numbers, mazes, weights, *scratch, counts, actions)
        return MazeResults(weights / sizes, counts, actions)


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
    for neuron in range(INPUTS, values.size):
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
    actions[out] = _choose_action(numbers, weights, values, END, ONE if end == high else SMALL)
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
    for i in range(INPUTS):
        values[i] = ONE if i in (position, BIAS) else ZERO
    values[REWARD] = reward
    if numbers[3] == STEP:
        _reset_activations(values)
    for neuron in range(neurons):
        first = neuron * values.size
        sensed = _weighted_sum(weights, first, values, 0, INPUTS)
        values[INPUTS + neuron] = _activate(
            sensed + _weighted_sum(weights, first, values, INPUTS + modulatory, values.size)
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
        y = values[INPUTS + neuron]
        sent = _weighted_sum(weights, first, values, INPUTS, INPUTS + modulatory)
        gate = rate * _activate(sent) if modulatory > 0 else rate
        for begin, end in ((0, INPUTS), (INPUTS + modulatory, values.size)):
            for source in range(begin, end):
                x = values[source]
                weight = weights[first + source] + gate * (a * x * y + b * x + c * y + d)
                weights[first + source] = clamp(weight, WEIGHT)
