"""Model of T-mazes in which the high reward moves, and of networks with plastic synapses.

    baldwinlab reproduce soltoggio-2008

A lifetime is a hundred trips. A trip goes from home along a corridor to a turning point, then left
or right, to an end of the maze. In the double maze, a trip passes two turning points. One end has a
reward of 1, the other ends have 0.2. The high reward moves once, near the middle of a lifetime. The
agent goes straight on if the output is from -1/3 to 1/3, right if it is larger, and left if it is
smaller. A wrong action in a corridor or at a turning point is a crash, which costs 0.4 and ends the
trip. With `homing`, the agent must also return home. A wrong action on the way back costs 0.3 and
ends the trip.

The first input is 1 at a turning point, the second at an end, and the third at home. The fourth
input is the reward. The fifth is always 1. The activation of a neuron is tanh(a / 2), where a is
the weighted sum of the inputs and of the latest values of the standard neurons. The modulatory
neurons are updated first, then the standard neurons, the output last. After each step, each synapse
from an input or a standard neuron (activation x) to a neuron (activation y) changes by

    tanh(m / 2) rate (A x y + B x + C y + D)

where m is the sum of the signals that the neuron receives from modulatory neurons. Without
modulatory neurons, the factor tanh(m / 2) is 1. Weights are limited to [-10, 10].

The rule, the rewards and the trips are from memory. Our choices are as follows. The number of
neurons is a setting and all neurons are connected. (In the paper, mutations insert, duplicate and
delete neurons.) Synapses from modulatory neurons do not change. Activations are reset after each
trip (the setting `memory`), so only weights carry information between trips. Each corridor, turning
point and end takes one step. All agents of a generation of a run have the same maze.

The module `t_maze_trips` has the mazes and the networks.

References
----------
A. Soltoggio, J. A. Bullinaria, C. Mattiussi, P. Duerr and D. Floreano, "Evolutionary advantages of
neuromodulated plasticity in dynamic, reward-based scenarios", ALIFE XI (2008).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product
from typing import Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.simd import ONE
from baldwinlab.models import kit
from baldwinlab.models.t_maze_trips import (
    CRASHES,
    HIGH,
    LIFETIME,
    MAX_RATE,
    MAX_WEIGHT,
    N_INPUTS,
    N_RULE_GENES,
    STEP,
    TRIP,
    explore,
    high_reward_end,
)
from baldwinlab.parts import (
    LIFE,
    Field,
    GridView,
    LifeResults,
    Model,
    PathView,
    Variable,
    View,
    uniforms,
)

RESET_PERIODS: Final = {"step": STEP, "trip": TRIP, "life": LIFETIME}
# Maximum number of trips in a view.
MAX_SHOWN_TRIPS: Final = 1000
# Limits of the trip before which the high reward moves, in percent of the trips of a lifetime.
EARLIEST_CHANGE_PERCENT: Final = 35
LATEST_CHANGE_PERCENT: Final = 65
# Rewards and costs of the events of trips.
LOW_REWARD: Final = 0.2
CRASH_COST: Final = 0.4
LOST_COST: Final = 0.3
# Entry of `actions` for a step that a trip does not reach.
NOT_REACHED: Final = -2
# Heading up. A heading is a number of quarter turns clockwise from the right.
UP_HEADING: Final = 3
# Change of row and column in a step, by heading.
STEP_BY_HEADING: Final = ((0, 1), (1, 0), (0, -1), (-1, 0))
# Number of columns of a maze, with walls at the edges. Home is in the middle column.
MAZE_COLUMNS: Final = 7
HOME_COLUMN: Final = 3
# Kinds of cells in the view of trips, in the order of `cell_colors`.
WALL_CELL: Final = 1
HIGH_CELL: Final = 2
LOW_CELL: Final = 3


class Maze(NamedTuple):
    """Ends of the maze with the high reward, as indices. Only left turns lead to end 0."""

    # End that has the high reward first.
    first_end: int
    # Index of the first trip with the high reward at `second_end`.
    change: int
    # End to which the high reward moves.
    second_end: int


class MazeResults(NamedTuple):
    """Results of lifetimes. `TMazes.explore` describes slots."""

    # [run, agent, weight]: genes at death, from -1 to 1.
    learned: npt.NDArray[np.float32]
    # [run, agent, slot, event]: number of events, in the order HIGH, LOW, CRASHES, LOST.
    counts: kit.Integers
    # [slot, step] of the last agent: -1 left, 0 straight on, 1 right, or NOT_REACHED.
    actions: kit.Integers


def total_reward(counts: kit.Integers) -> kit.Numbers:
    """Return the total reward of trips from the counts of their events [..., 4].

    The events are a high reward, a low reward, a crash, and a trip that is lost on the way home.

    >>> float(total_reward(np.array([90, 10, 0, 0])))
    92.0
    """
    n_high, n_low, n_crashes, n_lost = np.moveaxis(counts, -1, 0)
    reward: kit.Numbers = n_high + LOW_REWARD * n_low - CRASH_COST * n_crashes - LOST_COST * n_lost
    return reward


def _trace_trip(turns: int, actions: Sequence[int]) -> list[tuple[int, int, int]]:
    """Return (row, column, heading) at home and after each action. `turns`: turning points."""
    row = 2 * turns + 1
    column = HOME_COLUMN
    heading = UP_HEADING
    # Index of the step at the end. Each turn has a corridor and a turning point before the end.
    end_position = 2 * turns
    n_positions_per_way = end_position + 1
    path = [(row, column, heading)]
    for position, action in enumerate(actions):
        if position == n_positions_per_way:
            # The agent turns around at the end.
            heading = (heading + 2) % 4
        # The last corridor before an end or home has no step. The move is two cells long instead.
        has_corridor = position % n_positions_per_way == end_position
        n_cells = 2 if has_corridor else 1
        turn = 0 if has_corridor else action
        row += n_cells * STEP_BY_HEADING[heading][0]
        column += n_cells * STEP_BY_HEADING[heading][1]
        heading = (heading + turn) % 4
        path.append((row, column, heading))
    return path


def _draw_maze(turns: int, high: int) -> npt.NDArray[np.uint8]:
    """Return the content of each cell [row, column] if the end `high` has the high reward."""
    paths = []
    for route in product((-1, 1), repeat=turns):
        # The action 0 is straight on, in each corridor and at the end.
        actions = [action for turn in route for action in (0, turn)] + [0]
        paths.append(_trace_trip(turns, actions))
    maze = np.full((2 * turns + 3, MAZE_COLUMNS), WALL_CELL, np.uint8)
    steps = [step for path in paths for step in pairwise(path)]
    for (row, column, _), (to_row, to_column, _) in steps:
        maze[
            min(row, to_row) : max(row, to_row) + 1,
            min(column, to_column) : max(column, to_column) + 1,
        ] = 0
    for end, path in enumerate(paths):
        maze[path[-1][:2]] = HIGH_CELL if end == high else LOW_CELL
    return maze


def _view_trips(model: TMazes, key: Any, genomes: kit.Genomes, agent: int) -> GridView:
    """Return the trips of an agent in the maze, one frame per entry of `_trace_trip`."""
    trips = min(model.trips, MAX_SHOWN_TRIPS)
    agent_genome = genomes[None, [agent]]
    results = model.explore(
        key.seed, [key.run], key.generation, agent_genome, trips=trips, slots=trips
    )
    maze = model.maze(key.seed, key.run, key.generation)
    turns = model.turning_points
    mazes = np.stack([_draw_maze(turns, end) for end in range(2**turns)])
    high_ends = [high_reward_end(maze, trip) for trip in range(trips)]
    paths = [_trace_trip(turns, trip[trip != NOT_REACHED].tolist()) for trip in results.actions]
    n_frames = [len(path) for path in paths]
    counts = results.counts[0, 0]
    # The frames up to the end show 0, later frames the reward of the end without costs. Frame 0 is
    # at home, and frame i follows step i - 1. Step 2 * turns is at the end.
    gained = [
        np.where(np.arange(count) > 2 * turns, reward, 0.0)
        for count, reward in zip(n_frames, total_reward(counts * [1, 1, 0, 0]), strict=True)
    ]
    # The last frame of a trip shows the total reward, with costs.
    for trip_gained, reward in zip(gained, total_reward(counts), strict=True):
        trip_gained[-1] = reward
    row, column, heading = np.concatenate(paths).T
    return GridView(
        cell_colors={"wall": "edge", "high reward": "green", "low reward": "orange"},
        cells=np.repeat(mazes[high_ends], n_frames, axis=0),
        position=np.stack([row, column], axis=-1),
        heading=heading,
        gained=np.concatenate(gained),
        visit=np.repeat(np.arange(trips), n_frames),
        visit_label="trip",
    )


def _view_returns(model: TMazes, key: Any, genomes: kit.Genomes, agent: int) -> PathView:
    """Return the total reward after each trip, for an agent and for all agents."""
    trips = min(model.trips, MAX_SHOWN_TRIPS)
    results = model.explore(
        key.seed, [key.run], key.generation, genomes[None], trips=trips, slots=trips
    )
    counts = results.counts[0]
    # [agent, trip]: the total reward is 0 before the first trip.
    returns = np.pad(total_reward(counts.cumsum(axis=1)), ((0, 0), (1, 0)))
    lines = {
        f"agent {agent}": returns[agent],
        "average of all": returns.mean(axis=0),
        "best of all": returns.max(axis=0),
    }
    return PathView(lines, "trip", "total reward after the trip")


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

    defaults = {
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
    payoff = "reward gained in a lifetime"
    assimilation_obstacle = "The end with the high reward changes within and between lives."
    settings_without_learning = {"plasticity": False}
    records = {
        "high": Variable.share("share of trips that reach the high reward"),
        "crashed": Variable.share("share of trips that end in a crash"),
    }
    views = {
        "trips": View(
            "An agent in its maze, cell by cell, for each trip. After a crash it "
            "faces the wall. The position of the high reward, and its change, are "
            "drawn for each generation.",
            _view_trips,
        ),
        "returns": View(
            (
                "Gain of an agent after each trip, compared with the average and the best"
                " of its generation."
            ),
            _view_returns,
        ),
    }

    @property
    def steps(self) -> int:
        """Return the number of steps of a lifetime without crashes, with the steps at home."""
        # Each turn has a step in a corridor and a step at a turning point, on each way.
        n_positions_per_way = 2 * self.turning_points
        n_ways = 2 if self.homing else 1
        # The end and home are two more steps.
        return self.trips * (n_positions_per_way * n_ways + 2)

    @property
    def neurons(self) -> int:
        return self.modulatory_neurons + self.standard_neurons + 1

    def n_weights(self) -> int:
        return self.neurons * (N_INPUTS + self.neurons) + N_RULE_GENES

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        draws = kit.draw_founder_numbers(key, agents, self.n_weights())
        return (2 * draws - 1).astype(np.float32)

    def maze(self, seed: int, run: int, generation: int) -> Maze:
        """Draw the maze of a generation."""
        first_draw, change_draw, second_draw, _ = uniforms(seed, run, generation, LIFE, (1, 1))[
            0, 0
        ]
        n_ends = 2**self.turning_points
        first_end = int(first_draw * n_ends)
        earliest = self.trips * EARLIEST_CHANGE_PERCENT // 100
        latest = self.trips * LATEST_CHANGE_PERCENT // 100
        change = earliest + int(change_draw * (latest - earliest + 1))
        # A random end except the first end.
        second_end = (first_end + 1 + int(second_draw * (n_ends - 1))) % n_ends
        return Maze(first_end=first_end, change=change, second_end=second_end)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        results = self.explore(seed, runs, generation, genomes, trips=self.trips, slots=1)
        counts = results.counts
        # The single slot has the events of all trips.
        rewards = total_reward(counts[:, :, 0])
        records = {
            "high": counts[..., 0, HIGH] / self.trips,
            "crashed": counts[..., 0, CRASHES] / self.trips,
        }
        return self.make_results(rewards, records, learned=results.learned)

    def explore(
        self,
        seed: int,
        runs: Sequence[int],
        generation: int,
        genomes: kit.Genomes,
        *,
        trips: int,
        slots: int,
    ) -> MazeResults:
        """Simulate the first `trips` trips of lifetimes.

        `slots` is the number of results per agent: `trips` for one result per trip, or 1 for the
        sum of all trips.
        """
        gene_limits = np.full(self.n_weights(), MAX_WEIGHT)
        gene_limits[-N_RULE_GENES:] = 1, 1, 1, 1, MAX_RATE
        weights = np.clip(genomes[:, :, 0], -ONE, ONE) * gene_limits
        network = self.neurons, self.modulatory_neurons, self.plasticity, RESET_PERIODS[self.memory]
        # In the order of the indices `NEURONS` to `TRIPS` of `t_maze_trips`.
        settings = np.array([*network, self.turning_points, self.homing, trips])
        mazes = np.array([self.maze(seed, run, generation) for run in runs])
        counts = np.zeros((*genomes.shape[:2], slots, 4), np.int64)
        actions = np.full((slots, 4 * self.turning_points + 2), NOT_REACHED, np.int64)
        scratch = poison.empty(N_INPUTS + self.neurons, np.float32), poison.empty(4, np.int64)
        explore(settings, mazes, weights, *scratch, counts, actions)
        return MazeResults(weights / gene_limits, counts, actions)
