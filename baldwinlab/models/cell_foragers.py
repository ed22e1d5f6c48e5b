"""Foragers on a grid, one agent per world, that learn from additional outputs or from a teacher.

    baldwinlab reproduce nolfi-parisi-1993

A grid of 10 by 10 cells has ten items of food. An agent eats an item by entering its cell. The
agent senses the angle of the nearest item, relative to its heading, the distance of this item, and
the two bits of its next action. Its network computes the action after that: stay (00), turn right
(01), turn left (10) or go ahead (11). A lifetime has several environments with a number of steps
each. Fitness is the mean food per environment.

`learning` is one of: nothing; the action, with the outputs of an inherited teaching module as
targets (auto-teaching); the next sensation, on two additional outputs; or random numbers on these
outputs, as a control.

The world, the lifetimes, the evolution and the prediction follow Nolfi et al. 1994. The numbers of
both papers are from memory. Our choices are as follows: a move off the grid has no effect; an agent
begins in any cell with any heading; without food, the angle is 0 and the distance is 1.

References
----------
S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive Behavior
3 (1994).
S. Nolfi and D. Parisi, "Auto-teaching: networks that develop their own teaching input", ECAL 93.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.engine import poison
from baldwinlab.engine.arithmetic import share_of_turn, sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import square_root
from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.models.grid_frames import foraged
from baldwinlab.parts import (
    FOUNDER,
    LIFE,
    OF_AGENT,
    Field,
    GridView,
    LifeResults,
    Measure,
    Model,
    Variable,
    Variation,
    View,
    philox,
    unit,
)

# The angle and the distance of the nearest food, and the two bits of the next action.
INPUTS: Final = 4
# Number of outputs for the planned action.
ACTIONS: Final = 2
# Cells per edge.
SIDE = 10
# Number of items.
FOOD = 10
FARTHEST: Final = np.float32(SIDE - 1) * np.float32(1.4142135)
ONE = np.float32(1)
HALF = np.float32(0.5)
ZERO = np.float32(0)
# Learning targets.
NOTHING, INHERITED_TEACHER, NEXT_SENSATION, NOISE = range(4)
TARGETS: Final = {
    "none": NOTHING,
    "auto-teaching": INHERITED_TEACHER,
    "prediction": NEXT_SENSATION,
    "random-targets": NOISE,
}
# A lifetime is divided into this number of equal periods. The first and the last are compared.
PERIODS: Final = 6
# Approximate maximum number of moves in a view.
MAX_SHOWN_MOVES: Final = 20_000
# Number of random draws that are reserved for an environment.
DRAWS: Final = 4096


def _gain(generation: int) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return the mean gain of a generation, or of the last generation if there are fewer."""
    return lambda runs: (
        runs["gain"].isel(generation=min(generation, runs.sizes["generation"] - 1)).mean("agent")
    )


def _view_lifetime(
    model: CellForagers, key: Any, genomes: npt.NDArray[np.float32], agent: int
) -> GridView:
    environments = min(model.environments, max(1, MAX_SHOWN_MOVES // model.steps_per_environment))
    results = model.forage(
        key.seed,
        [key.run],
        key.generation,
        genomes[None, [agent]],
        agent,
        environments,
        environments,
    )
    return foraged(SIDE, results.food, results.track, "environment")


class ForagingResults(NamedTuple):
    """Results of lifetimes, and the course of the last simulated environments."""

    # [run, agent, weight]: the action module at death.
    learned: npt.NDArray[np.float32]
    # [run, agent, environment].
    eaten: npt.NDArray[np.int32]
    # [environment, item]: the cells of the food.
    food: npt.NDArray[np.int64]
    # [environment, move, (cell, heading)].
    track: npt.NDArray[np.int64]


class CellForagers(Model, name="cell-foragers"):
    """Foragers on a grid whose networks learn during life."""

    learning: Literal["none", "auto-teaching", "prediction", "random-targets"] = Field(
        "none", description="Content of learning."
    )
    learning_rate: float = Field(
        0.15,
        ge=0,
        le=10,
        description="Learning rate. 0: the same genome without learning.",
    )
    hidden_units: int = Field(7, ge=1, le=100, description="Number of hidden units per module.")
    environments: int = Field(
        24,
        ge=6,
        le=1000,
        description=(
            "Number of environments in a lifetime, each with its own start position and food."
        ),
    )
    steps_per_environment: int = Field(
        50, ge=1, le=10_000, description="Number of steps per environment."
    )

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 100},
        "evolution": {
            "generations": 51,
            "selection": "best-copies",
            "variation": "few-mutations",
            "mutation_size": 1.0,
        },
        "record": {"genome_every": 10},
    }
    payoff: ClassVar[str] = "food eaten per environment"
    records: ClassVar[Mapping[str, Variable]] = {
        "gain": Variable(
            OF_AGENT,
            np.float32,
            "items",
            "food per environment in the last sixth of life minus that in the first",
        ),
    }
    views: ClassVar[Mapping[str, View]] = {
        "life": View(
            (
                "An agent and its food, step by step. Eaten food disappears. Each "
                "environment has its own food."
            ),
            _view_lifetime,
        )
    }
    measures: ClassVar[Mapping[str, Measure]] = {
        "gain-0": Measure("gain within life in generation 0, items an environment", _gain(0)),
        "gain-10": Measure("gain within life in generation 10, items an environment", _gain(10)),
        "gain-20": Measure("gain within life in generation 20, items an environment", _gain(20)),
        "gain-50": Measure("gain within life in generation 50, items an environment", _gain(50)),
        "gain-falls": Measure(
            "gain within life in generation 10 minus that in generation 50",
            lambda runs: _gain(10)(runs) - _gain(50)(runs),
        ),
    }

    @property
    def modules(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("action", "reinforcement") if self.learning == "auto-teaching" else ("action",)

    @property
    def learns(self) -> bool:
        return self.learning != "none" and self.learning_rate > 0

    @property
    def steps(self) -> int:
        return self.environments * self.steps_per_environment

    @property
    def outputs(self) -> int:
        """Return the number of outputs: two for the action, and two if targets are additional."""
        return ACTIONS + (2 if self.learning in ("prediction", "random-targets") else 0)

    def without_learning(self) -> CellForagers:
        return self.model_copy(update={"learning_rate": 0.0})

    def weights(self) -> int:
        return (INPUTS + 1) * self.hidden_units + (self.hidden_units + 1) * self.outputs

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        modules = len(self.modules)
        draws = key.uniforms(FOUNDER, (agents, modules * self.weights()))[:, :, 0]
        drawn: npt.NDArray[np.float32] = (2 * draws - 1).astype(np.float32)
        return drawn.reshape(agents, modules, -1)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        learned, eaten, *_ = self.forage(seed, runs, generation, genomes, 0, self.environments, 1)
        part = self.environments // PERIODS
        gain = eaten[..., -part:].mean(axis=-1) - eaten[..., :part].mean(axis=-1)
        energy = eaten.sum(axis=-1) / self.environments
        return LifeResults(
            energy, np.zeros_like(energy), learned, {"gain": gain.astype(np.float32)}
        )

    def forage(
        self,
        seed: int,
        runs: Sequence[int],
        generation: int,
        genomes: npt.NDArray[np.float32],
        first: int,
        environments: int,
        recorded: int,
    ) -> ForagingResults:
        """Simulate environments of the agents from number `first` on.

        Parameters
        ----------
        seed : int
            Seed of the study.
        runs : sequence of int
            Numbers of the runs.
        generation : int
            Number of the generation.
        genomes : array of shape (runs, agents, modules, weights)
            Genomes.
        first : int
            Number of the first agent.
        environments : int
            Number of environments per agent.
        recorded : int
            Number of environments whose course is returned, for the last agent.
        """
        learned = genomes[:, :, 0].copy()
        fixed = np.ascontiguousarray(genomes[:, :, -1])
        eaten = poison.empty((*genomes.shape[:2], environments), np.int32)
        units = poison.empty((3, INPUTS + self.hidden_units + self.outputs), np.float32)
        food = poison.empty((recorded, FOOD), np.int64)
        track = poison.empty((recorded, self.steps_per_environment, 2), np.int64)
        code = TARGETS[self.learning] if self.learns else NOTHING
        numbers = np.array(
            [seed, generation, code, self.hidden_units, self.outputs, first], np.int64
        )
        scratch = units, poison.empty(FOOD, np.int64), food, track
        forage(
            numbers,
            np.array(runs, np.int64),
            np.float32(self.learning_rate),
            learned,
            fixed,
            *scratch,
            eaten,
        )
        return ForagingResults(learned, eaten, food, track)


@jit_entry_point
def forage(
    numbers: Any,
    runs: Any,
    rate: Any,
    weights: Any,
    fixed: Any,
    units: Any,
    food: Any,
    sown: Any,
    track: Any,
    eaten: Any,
) -> None:
    """Simulate the lifetimes of all agents.

    Parameters
    ----------
    numbers : array of shape (6,)
        Seed, generation, learning target, number of hidden units, number of outputs, and number of
        the first agent.
    runs : array of shape (runs,)
        Numbers of the runs.
    rate : float32
        Learning rate.
    weights : array of shape (runs, agents, weights)
        Weights of the action module. They change in place as agents learn.
    fixed : array of shape (runs, agents, weights)
        Weights of the teaching module.
    units : array of shape (3, units)
        Scratch.
    food : array of shape (items,)
        Scratch.
    sown : array of shape (recorded, items)
        Output: the cells of the food in the last environments.
    track : array of shape (recorded, moves, 2)
        Output: cell and heading after each move in the last environments.
    eaten : array of shape (runs, agents, environments)
        Output: the number of eaten items.
    """
    recorded = sown.shape[0]
    for run in range(runs.size):
        for agent in range(weights.shape[1]):
            for environment in range(eaten.shape[2]):
                record = sown[environment % recorded], track[environment % recorded]
                eaten[run, agent, environment] = _visit(
                    numbers,
                    runs[run],
                    agent,
                    environment,
                    rate,
                    weights[run, agent],
                    fixed[run, agent],
                    units,
                    food,
                    record,
                )


@compiled
def _visit(
    numbers: Any,
    run: Any,
    lane: Any,
    environment: Any,
    rate: Any,
    weights: Any,
    fixed: Any,
    units: Any,
    food: Any,
    record: Any,
) -> int:
    """Return the number of items that an agent eats in one environment.

    `record` has the arrays for the cells of the food and for the track of the agent.
    """
    seed = numbers[0]
    generation = numbers[1]
    target = numbers[2]
    hidden = numbers[3]
    outputs = numbers[4]
    agent = numbers[5] + lane
    sown, track = record
    first = environment * DRAWS
    begin = philox(first, agent, generation, LIFE, seed, run)
    cell = int(unit(begin[0]) * np.float32(SIDE * SIDE))
    heading = int(unit(begin[1]) * np.float32(4))
    _sow(food, first, agent, generation, seed, run)
    for item in range(food.size):
        sown[item] = food[item]
    values = units[0]
    teacher = units[1]
    scratch = units[2]
    plan = 0
    eaten = 0
    # An earlier move, with the state of the agent and the eaten items after it.
    reference_move = -1
    reference_state = -1
    reference_eaten = 0
    values[0], values[1] = _sense(food, cell, heading)
    for move in range(track.shape[0]):
        values[2] = np.float32(plan >> 1)
        values[3] = np.float32(plan & 1)
        _forward(weights, hidden, outputs, values)
        cell, heading = _execute(plan, cell, heading)
        eaten += _eat_item(food, cell)
        track[move, 0] = cell
        track[move, 1] = heading
        bits = INPUTS + hidden
        plan = 2 * int(values[bits] > HALF) + int(values[bits + 1] > HALF)
        # Without learning, an agent in an earlier state with the same food repeats its moves.
        if target == NOTHING:
            state = 16 * cell + 4 * heading + plan
            if state == reference_state and eaten == reference_eaten:
                _repeat_moves(track, move, move - reference_move)
                return eaten
            if eaten > reference_eaten or move > 2 * reference_move:
                reference_move = move
                reference_state = state
                reference_eaten = eaten
        angle, distance = _sense(food, cell, heading)
        if target == INHERITED_TEACHER:
            for k in range(INPUTS):
                teacher[k] = values[k]
            _forward(fixed, hidden, outputs, teacher)
            _backpropagate(
                weights, hidden, outputs, 0, rate, values, teacher[bits], teacher[bits + 1], scratch
            )
        elif target == NEXT_SENSATION:
            _backpropagate(
                weights, hidden, outputs, ACTIONS, rate, values, angle, distance, scratch
            )
        elif target == NOISE:
            coin = philox(first + DRAWS - 1 - move, agent, generation, LIFE, seed, run)
            _backpropagate(
                weights,
                hidden,
                outputs,
                ACTIONS,
                rate,
                values,
                unit(coin[0]),
                unit(coin[1]),
                scratch,
            )
        values[0] = angle
        values[1] = distance
    return eaten


@compiled
def _repeat_moves(track: Any, move: Any, period: Any) -> None:
    """Fill the track after a move with the moves of one period before."""
    for later in range(move + 1, track.shape[0]):
        track[later, 0] = track[later - period, 0]
        track[later, 1] = track[later - period, 1]


@compiled
def _sow(food: Any, first: Any, agent: Any, generation: Any, seed: Any, run: Any) -> None:
    """Draw a different cell for each item. An occupied cell is drawn again."""
    draw = first
    for item in range(food.size):
        is_free = False
        while not is_free:
            draw += 1
            word = philox(draw, agent, generation, LIFE, seed, run)[0]
            cell = int(unit(word) * np.float32(SIDE * SIDE))
            is_free = True
            for earlier in range(item):
                is_free = is_free and food[earlier] != cell
            food[item] = cell


@compiled
def _sense(food: Any, cell: Any, heading: Any) -> Any:
    """Return the angle and the distance of the nearest food.

    The angle is clockwise from the heading, as a share of a turn. The distance is a share of the
    largest distance.
    """
    nearest = 2 * SIDE * SIDE
    u = 0
    v = 0
    for item in range(food.size):
        if food[item] >= 0:
            dx = food[item] % SIDE - cell % SIDE
            dy = food[item] // SIDE - cell // SIDE
            if dx * dx + dy * dy < nearest:
                nearest = dx * dx + dy * dy
                u = dx
                v = dy
    if nearest == 2 * SIDE * SIDE:
        return ZERO, ONE
    for _ in range(heading):
        u, v = v, -u
    return share_of_turn(np.float32(u), np.float32(v)), square_root(np.float32(nearest)) / FARTHEST


@compiled
def _execute(plan: Any, cell: Any, heading: Any) -> Any:
    """Return the cell and the heading after an action: stay, turn right, turn left or go ahead."""
    if plan == 1:
        return cell, (heading + 1) % 4
    if plan == 2:
        return cell, (heading + 3) % 4
    if plan == 3:
        x = cell % SIDE + int(heading == 0) - int(heading == 2)
        y = cell // SIDE + int(heading == 1) - int(heading == 3)
        if 0 <= x < SIDE and 0 <= y < SIDE:
            return y * SIDE + x, heading
    return cell, heading


@compiled
def _eat_item(food: Any, cell: Any) -> int:
    eaten = 0
    for item in range(food.size):
        if food[item] == cell:
            food[item] = -1
            eaten = 1
    return eaten


@compiled
def _forward(weights: Any, hidden: Any, outputs: Any, values: Any) -> None:
    """Compute the hidden units and the outputs of `values` [unit] from its inputs.

    All units are logistic and have a bias.
    """
    for hidden_unit in range(hidden):
        total = weights[INPUTS * hidden + hidden_unit]
        for i in range(INPUTS):
            total += weights[i * hidden + hidden_unit] * values[i]
        values[INPUTS + hidden_unit] = sigmoid(total)
    after = (INPUTS + 1) * hidden
    for k in range(outputs):
        total = weights[after + hidden * outputs + k]
        for hidden_unit in range(hidden):
            total += weights[after + hidden_unit * outputs + k] * values[INPUTS + hidden_unit]
        values[INPUTS + hidden + k] = sigmoid(total)


@compiled
def _backpropagate(
    weights: Any,
    hidden: Any,
    outputs: Any,
    first: Any,
    rate: Any,
    values: Any,
    first_target: Any,
    second_target: Any,
    scratch: Any,
) -> None:
    """Do one step of backpropagation from the outputs `first` and `first + 1` to two targets."""
    after = (INPUTS + 1) * hidden
    for k in range(2):
        y = values[INPUTS + hidden + first + k]
        scratch[k] = (y - (first_target if k == 0 else second_target)) * y * (ONE - y)
    for hidden_unit in range(hidden):
        h = values[INPUTS + hidden_unit]
        error = ZERO
        for k in range(2):
            weight = after + hidden_unit * outputs + first + k
            error += scratch[k] * weights[weight]
            weights[weight] -= rate * scratch[k] * h
        error = error * h * (ONE - h)
        for i in range(INPUTS):
            weights[i * hidden + hidden_unit] -= rate * error * values[i]
        weights[INPUTS * hidden + hidden_unit] -= rate * error
    for k in range(2):
        weights[after + hidden * outputs + first + k] -= rate * scratch[k]


class FewMutations(Variation, name="few-mutations"):
    """Copy of one parent, chosen at random; a fixed number of weights mutates.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    mutations: int = Field(
        5,
        ge=0,
        le=1000,
        description="Number of weights of a child that mutate, drawn with replacement.",
    )
    derived: ClassVar[Mapping[str, Any]] = {
        "size": lambda part, experiment: float(experiment.evolution.mutation_size)
    }

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                child[module, weight] = (
                    fitter[module, weight] if gate < 0.5 else second[module, weight]
                )
        for mutation in range(min(part.mutations, draws.shape[0])):
            weight = int(draws[mutation, 1] * child.size)
            child[weight // child.shape[1], weight % child.shape[1]] += np.float32(
                (2.0 * draws[mutation, 2] - 1.0) * part.size
            )

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        child = [list(module) for module in (fitter if gate < 0.5 else second)]
        for _, position, size, _ in draws[: part.mutations]:
            module, weight = divmod(int(position * len(child) * len(child[0])), len(child[0]))
            child[module][weight] += (2 * size - 1) * part.size
        return child
