"""T-mazes in which the high reward moves: networks whose synapses change in life, as modulatory neurons gate them, or ungated.

    baldwinlab reproduce soltoggio-2008

A life is a hundred trips, each from home along a corridor to a turning point, left or right, to a
maze end; in the double maze over two such turning points. One end has a reward of 1, the others
0.2; once in a life, near its middle, the high reward moves. The output goes straight on where it is
within 1/3 of 0, else right or left; to do otherwise than a corridor or a turning point asks is a
crash, which costs 0.4 and ends the trip. With `homing` the way back is to be found, too, or 0.3 is
lost.

Inputs are 1 at a turning point, at an end, at home, and always; one is the reward. A neuron's
activation is tanh(a / 2), with a summed over inputs and standard neurons as they last were; first
the modulatory neurons are asked, then the standard ones, the output last. After every step each
synapse, from an input or a standard neuron at x to a neuron at y, changes by

    tanh(m / 2) rate (A x y + B x + C y + D)

with m what modulatory neurons send to y; without such neurons, by all of that. Weights stay within
10.

Source: A. Soltoggio, J. A. Bullinaria, C. Mattiussi, P. Duerr and D. Floreano, "Evolutionary
advantages of neuromodulated plasticity in dynamic, reward-based scenarios", ALIFE XI (2008); rule,
rewards and trips are from memory here. Readings of ours: a number of neurons that is given, all
connected (there, neurons are inserted, duplicated and deleted); synapses of modulatory neurons do
not change; activations last for a trip (`memory`), so that from trip to trip weights alone
remember; a place is one step; in a generation of a run, all agents have the same maze.
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
from baldwinlab.models.grid_frames import NOT_THERE, in_t_mazes
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
CORRIDOR: Final = -1  # where no input but the bias is 1
RULE: Final = 5  # genes after those of the weights: A, B, C, D and the rate
WEIGHT, RATE = (
    np.float32(10),
    np.float32(100),
)  # the greatest size of a weight, and of the rate; a gene is a share of it
HIGH, LOW, CRASHES, LOST = range(4)  # what is counted of trips
STEP, TRIP, LIFETIME = range(3)  # for which activations last
LASTS: Final = {"step": STEP, "trip": TRIP, "life": LIFETIME}
WATCHED: Final = 1000  # trips of a life that can be looked at
ZERO, ONE, TWO, THIRD, SMALL = (np.float32(number) for number in (0, 1, 2, 1 / 3, 0.2))


class Explored(NamedTuple):
    """What came of lives, and the course of the last trips."""

    learned: npt.NDArray[np.float32]  # [run, agent, weight], genes at death
    counts: npt.NDArray[
        np.int64
    ]  # [run, agent, kept, 4], of each trip, or of all where one is kept
    ways: npt.NDArray[
        np.int64
    ]  # [kept, place] of one agent: -1 left, 0 straight on, 1 right, NOT_THERE where it did not come


def gained(counts: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """What trips [..., 4], as they are counted, are worth."""
    high, low, crashes, lost = np.moveaxis(counts, -1, 0)
    worth: npt.NDArray[np.float64] = high + 0.2 * low - 0.4 * crashes - 0.3 * lost
    return worth


def _trips(model: TMazes, key: Any, genomes: npt.NDArray[np.float32], agent: int) -> GridView:
    trips = min(model.trips, WATCHED)
    lived = model.explore(key.seed, [key.run], key.generation, genomes[None, [agent]], trips, trips)
    maze = model.maze(key.seed, key.run, key.generation)
    high = [where_high(maze, trip) for trip in range(trips)]
    counts = lived.counts[0, 0]
    return in_t_mazes(
        model.turning_points, high, lived.ways, gained(counts * [1, 1, 0, 0]), gained(counts)
    )


def _returns(model: TMazes, key: Any, genomes: npt.NDArray[np.float32], agent: int) -> PathView:
    trips = min(model.trips, WATCHED)
    counts = model.explore(key.seed, [key.run], key.generation, genomes[None], trips, trips).counts[
        0
    ]
    returns = np.pad(gained(counts.cumsum(axis=1)), ((0, 0), (1, 0)))
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
        """Places that are passed if all goes well; home is one."""
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
        """The end that has the high reward at first, the trip before which it moves, and where to; ends are numbered from 0."""
        where, when, whither, _ = uniforms(seed, run, generation, LIFE, (1, 1))[0, 0]
        ends = 2**self.turning_points
        first, earliest, latest = int(where * ends), self.trips * 35 // 100, self.trips * 65 // 100
        return (
            first,
            earliest + int(when * (latest - earliest + 1)),
            (first + 1 + int(whither * (ends - 1))) % ends,
        )

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        learned, counts, _ = self.explore(seed, runs, generation, genomes, self.trips, 1)
        energy = gained(counts[:, :, 0])
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
        kept: int,
    ) -> Explored:
        """So many trips of lives, of which as many are kept apart."""
        sizes = np.full(self.weights(), WEIGHT)
        sizes[-RULE:] = 1, 1, 1, 1, RATE
        weights = np.clip(genomes[:, :, 0], -ONE, ONE) * sizes
        network = self.neurons, self.modulatory_neurons, self.plasticity, LASTS[self.memory]
        numbers = np.array([*network, self.turning_points, self.homing, trips])
        mazes = np.array([self.maze(seed, run, generation) for run in runs])
        counts = np.zeros((*genomes.shape[:2], kept, 4), np.int64)
        ways = np.full((kept, 4 * self.turning_points + 2), NOT_THERE, np.int64)
        scratch = poison.empty(INPUTS + self.neurons, np.float32), poison.empty(4, np.int64)
        explore(numbers, mazes, weights, *scratch, counts, ways)
        return Explored(weights / sizes, counts, ways)


@jit_entry_point
def explore(
    numbers: Any, mazes: Any, weights: Any, values: Any, done: Any, counts: Any, ways: Any
) -> None:
    """Fill `counts` [run, agent, kept, 4] of trips; `weights` [run, agent, weight] change as agents learn.

    `numbers` are neurons, modulatory ones, whether there is plasticity, how long activations last,
    turning points, whether to go home, and trips; `mazes` [run, 3] as `TMazes.maze` gives them;
    `values` [input and neuron] and `done` [4] are scratch; `ways` [kept, place] keep what is done
    in each place. Who carries nothing from trip to trip does the same until the reward moves.
    """
    values[:] = ZERO
    alike = numbers[2] == 0 and numbers[3] != LIFETIME
    for run in range(mazes.shape[0]):
        for agent in range(weights.shape[1]):
            _be_still(values)
            for trip in range(numbers[6]):
                slot, high = min(trip, ways.shape[0] - 1), where_high(mazes[run], trip)
                if alike and trip > 0 and high == where_high(mazes[run], trip - 1):
                    for place in range(ways.shape[1]):
                        ways[slot, place] = ways[max(slot - 1, 0), place]
                else:
                    if numbers[3] == TRIP:
                        _be_still(values)
                    done[:] = 0
                    _go(numbers, high, weights[run, agent], values, done, ways[slot])
                    _act(numbers, weights[run, agent], values, HOME, ZERO)
                for kind in range(done.size):
                    counts[run, agent, slot, kind] += done[kind]


@compiled
def where_high(maze: Any, trip: Any) -> int:
    """The end that has the high reward in a trip."""
    return maze[0] if trip < maze[1] else maze[2]  # type: ignore[no-any-return]


@compiled
def _be_still(values: Any) -> None:
    for neuron in range(INPUTS, values.size):
        values[neuron] = ZERO


@compiled
def _go(numbers: Any, high: Any, weights: Any, values: Any, counts: Any, ways: Any) -> None:
    """One trip. Its places are a corridor and a turning point for each turn, the end, as many on the way back, and home."""
    out, end = 2 * numbers[4], 0
    for place in range(out):
        turning = place % 2
        ways[place] = _act(numbers, weights, values, TURNING if turning else CORRIDOR, ZERO)
        if (ways[place] != 0) != turning:
            counts[CRASHES] += 1
            return
        if turning:
            end = 2 * end + (ways[place] + 1) // 2
    counts[HIGH if end == high else LOW] += 1
    ways[out] = _act(numbers, weights, values, END, ONE if end == high else SMALL)
    if numbers[5] == 1:
        for place in range(out + 1, 2 * out + 1):
            turning = 1 - place % 2
            ways[place] = _act(numbers, weights, values, TURNING if turning else CORRIDOR, ZERO)
            if ways[place] != turning * (1 - 2 * (end & 1)):
                counts[LOST] += 1
                return
            end >>= turning
        ways[2 * out + 1] = 0


@compiled
def _act(numbers: Any, weights: Any, values: Any, place: Any, reward: Any) -> int:
    """What the network does in a place: 1 is right, -1 left, 0 straight on. Then its synapses change."""
    neurons, modulatory = numbers[0], numbers[1]
    for i in range(INPUTS):
        values[i] = ONE if i in (place, BIAS) else ZERO
    values[REWARD] = reward
    if numbers[3] == STEP:
        _be_still(values)
    for neuron in range(neurons):
        first = neuron * values.size
        sensed = _sum(weights, first, values, 0, INPUTS)
        values[INPUTS + neuron] = _answer(
            sensed + _sum(weights, first, values, INPUTS + modulatory, values.size)
        )
    if numbers[2] == 1:
        _change(neurons, modulatory, weights, values)
    out = values[values.size - 1]
    return 1 if out > THIRD else -1 if out < -THIRD else 0


@compiled
def _sum(weights: Any, first: Any, values: Any, begin: Any, end: Any) -> Any:
    """What a neuron, whose weights begin at `first`, senses of some sources."""
    total = ZERO
    for source in range(begin, end):
        total += weights[first + source] * values[source]
    return total


@compiled
def _answer(total: Any) -> Any:
    """tanh(total / 2)."""
    return TWO * sigmoid(total) - ONE


@compiled
def _change(neurons: Any, modulatory: Any, weights: Any, values: Any) -> None:
    """Let every synapse from an input or a standard neuron change, as far as modulatory neurons let it."""
    rule = neurons * values.size
    a, b, c, d, rate = (
        weights[rule],
        weights[rule + 1],
        weights[rule + 2],
        weights[rule + 3],
        weights[rule + 4],
    )
    for neuron in range(neurons):
        first, y = neuron * values.size, values[INPUTS + neuron]
        sent = _sum(weights, first, values, INPUTS, INPUTS + modulatory)
        gate = rate * _answer(sent) if modulatory > 0 else rate
        for begin, end in ((0, INPUTS), (INPUTS + modulatory, values.size)):
            for source in range(begin, end):
                x = values[source]
                weight = weights[first + source] + gate * (a * x * y + b * x + c * y + d)
                weights[first + source] = clamp(weight, WEIGHT)
