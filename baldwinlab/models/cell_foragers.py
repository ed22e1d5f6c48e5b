"""Foragers in cells, each alone in its world, who learn by side outputs: to predict what comes, or from a teacher of their own.

    baldwinlab reproduce nolfi-parisi-1993

Ten by ten cells hold ten items of food, which vanish when somebody steps on them. An agent senses
the angle, from its heading, and the distance of the nearest, and the two bits of the action that it
is about to do; its network says what to do after that: stay (00), turn right (01), turn left (10)
or go ahead (11). A life is so many environments of so many steps; its fitness is the food of an
average one. What is learned: nothing; the action, towards the answers of a teaching module on the
same inputs, both of them inherited (auto-teaching); what will be sensed next, on two outputs more;
or, as a control for that, random numbers.

Sources: S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive
Behavior 3 (1994), for the world, lives, evolution and prediction; S. Nolfi and D. Parisi,
"Auto-teaching: networks that develop their own teaching input", ECAL 93. Their numbers here are
from memory; readings of ours are that moves off the grid do nothing, that an agent begins in any
cell with any heading, and that without food the angle is 0 and the distance 1.
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

# The angle and the distance of the nearest food, and the two bits of the action about to be done.
INPUTS: Final = 4
ACTIONS: Final = 2  # outputs that plan
SIDE, FOOD = 10, 10  # cells along an edge, and items
FARTHEST: Final = np.float32(SIDE - 1) * np.float32(1.4142135)
ONE, HALF, ZERO = np.float32(1), np.float32(0.5), np.float32(0)
NOTHING, OWN_TEACHER, NEXT_SENSATION, NOISE = range(4)  # what is learned
LEARNED: Final = {
    "none": NOTHING,
    "auto-teaching": OWN_TEACHER,
    "prediction": NEXT_SENSATION,
    "random-targets": NOISE,
}
PARTS_OF_LIFE: Final = 6  # of which the first and the last are compared
WATCHED: Final = 20_000  # moves of a life that can be looked at, about
DRAWS: Final = 4096  # for an environment: its own numbers, however many are drawn again


def _gain(generation: int) -> Callable[[xr.Dataset], xr.DataArray]:
    """Of the average agent of a generation, or of the last where there are not so many."""
    return lambda runs: (
        runs["gain"].isel(generation=min(generation, runs.sizes["generation"] - 1)).mean("agent")
    )


def _life(model: CellForagers, key: Any, genomes: npt.NDArray[np.float32], agent: int) -> GridView:
    environments = min(model.environments, max(1, WATCHED // model.steps_per_environment))
    lived = model.forage(
        key.seed,
        [key.run],
        key.generation,
        genomes[None, [agent]],
        agent,
        environments,
        environments,
    )
    return foraged(SIDE, lived.food, lived.track, "environment")


class Foraged(NamedTuple):
    """What came of lives, and the course of the last that was lived."""

    learned: npt.NDArray[np.float32]  # [run, agent, weight], the action module at death
    eaten: npt.NDArray[np.int32]  # [run, agent, environment]
    food: npt.NDArray[np.int64]  # [environment, item], the cells where food lay
    track: npt.NDArray[
        np.int64
    ]  # [environment, move, (place, heading)]; of both, as many environments at the end as were kept


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
            _life,
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
        """Two that plan, and two more where something is learned on the side."""
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
        part = self.environments // PARTS_OF_LIFE
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
        kept: int,
    ) -> Foraged:
        """So many environments of the lives of agents from number `first` on, the course of `kept` of them."""
        learned = genomes[:, :, 0].copy()
        fixed = np.ascontiguousarray(genomes[:, :, -1])
        eaten = poison.empty((*genomes.shape[:2], environments), np.int32)
        units = poison.empty((3, INPUTS + self.hidden_units + self.outputs), np.float32)
        food, track = (
            poison.empty((kept, FOOD), np.int64),
            poison.empty((kept, self.steps_per_environment, 2), np.int64),
        )
        code = LEARNED[self.learning] if self.learns else NOTHING
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
        return Foraged(learned, eaten, food, track)


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
    """Fill `eaten` [run, agent, environment]; `weights` [run, agent, weight] change as agents learn.

    `numbers` are seed, generation, what is learned, hidden units, outputs and the first agent's
    number; `fixed` is the teaching module; `units` [3, unit] and `food` [item] are scratch. `sown`
    and `track` keep the course of as many environments as they have room for, the last ones.
    """
    kept = sown.shape[0]
    for run in range(runs.size):
        for agent in range(weights.shape[1]):
            for environment in range(eaten.shape[2]):
                seen = sown[environment % kept], track[environment % kept]
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
                    seen,
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
    seen: Any,
) -> int:
    """The food that an agent eats in one environment; `seen` are where the food lay and the agent's track."""
    seed, generation, learned = numbers[0], numbers[1], numbers[2]
    hidden, outputs, agent = numbers[3], numbers[4], numbers[5] + lane
    sown, track = seen
    first = environment * DRAWS
    begin = philox(first, agent, generation, LIFE, seed, run)
    place, heading = (
        int(unit(begin[0]) * np.float32(SIDE * SIDE)),
        int(unit(begin[1]) * np.float32(4)),
    )
    _sow(food, first, agent, generation, seed, run)
    for item in range(food.size):
        sown[item] = food[item]
    values, teacher, scratch = units[0], units[1], units[2]
    plan, eaten = 0, 0
    since, stood, fed = (
        -1,
        -1,
        0,
    )  # a move before, how the agent stood after it, and what it had eaten by then
    values[0], values[1] = _sense(food, place, heading)
    for move in range(track.shape[0]):
        values[2], values[3] = np.float32(plan >> 1), np.float32(plan & 1)
        _answer(weights, hidden, outputs, values)
        place, heading = _act(plan, place, heading)
        eaten += _eat(food, place)
        track[move, 0], track[move, 1] = place, heading
        bits = INPUTS + hidden
        plan = 2 * int(values[bits] > HALF) + int(values[bits + 1] > HALF)
        if learned == NOTHING:  # who stands as before, among the same food, goes round for good
            stands = 16 * place + 4 * heading + plan
            if stands == stood and eaten == fed:
                _go_round(track, move, move - since)
                return eaten
            if eaten > fed or move > 2 * since:
                since, stood, fed = move, stands, eaten
        angle, distance = _sense(food, place, heading)
        if learned == OWN_TEACHER:
            for k in range(INPUTS):
                teacher[k] = values[k]
            _answer(fixed, hidden, outputs, teacher)
            _learn(
                weights, hidden, outputs, 0, rate, values, teacher[bits], teacher[bits + 1], scratch
            )
        elif learned == NEXT_SENSATION:
            _learn(weights, hidden, outputs, ACTIONS, rate, values, angle, distance, scratch)
        elif learned == NOISE:
            coin = philox(first + DRAWS - 1 - move, agent, generation, LIFE, seed, run)
            _learn(
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
        values[0], values[1] = angle, distance
    return eaten


@compiled
def _go_round(track: Any, move: Any, period: Any) -> None:
    """Fill what follows a move with what went before."""
    for later in range(move + 1, track.shape[0]):
        track[later, 0], track[later, 1] = track[later - period, 0], track[later - period, 1]


@compiled
def _sow(food: Any, first: Any, agent: Any, generation: Any, seed: Any, run: Any) -> None:
    """Draw a cell for each item, and again where another lies already."""
    draw = first
    for item in range(food.size):
        free = False
        while not free:
            draw += 1
            cell, free = (
                int(
                    unit(philox(draw, agent, generation, LIFE, seed, run)[0])
                    * np.float32(SIDE * SIDE)
                ),
                True,
            )
            for other in range(item):
                free = free and food[other] != cell
            food[item] = cell


@compiled
def _sense(food: Any, place: Any, heading: Any) -> Any:
    """The angle of the nearest food, clockwise from the heading as a share of a turn, and its distance as one of the farthest."""
    least, u, v = 2 * SIDE * SIDE, 0, 0
    for item in range(food.size):
        if food[item] >= 0:
            dx, dy = food[item] % SIDE - place % SIDE, food[item] // SIDE - place // SIDE
            if dx * dx + dy * dy < least:
                least, u, v = dx * dx + dy * dy, dx, dy
    if least == 2 * SIDE * SIDE:
        return ZERO, ONE
    for _ in range(heading):
        u, v = v, -u
    return share_of_turn(np.float32(u), np.float32(v)), square_root(np.float32(least)) / FARTHEST


@compiled
def _act(plan: Any, place: Any, heading: Any) -> Any:
    """Stay, turn right, turn left, or go ahead where there is a cell: the place and the heading after it."""
    if plan == 1:
        return place, (heading + 1) % 4
    if plan == 2:
        return place, (heading + 3) % 4
    if plan == 3:
        x = place % SIDE + (1 if heading == 0 else -1 if heading == 2 else 0)
        y = place // SIDE + (1 if heading == 1 else -1 if heading == 3 else 0)
        if 0 <= x < SIDE and 0 <= y < SIDE:
            return y * SIDE + x, heading
    return place, heading


@compiled
def _eat(food: Any, place: Any) -> int:
    eaten = 0
    for item in range(food.size):
        if food[item] == place:
            food[item], eaten = -1, 1
    return eaten


@compiled
def _answer(weights: Any, hidden: Any, outputs: Any, values: Any) -> None:
    """Fill `values` [unit] from its inputs on: logistic units, each with a bias."""
    for unit_of in range(hidden):
        total = weights[INPUTS * hidden + unit_of]
        for i in range(INPUTS):
            total += weights[i * hidden + unit_of] * values[i]
        values[INPUTS + unit_of] = sigmoid(total)
    after = (INPUTS + 1) * hidden
    for k in range(outputs):
        total = weights[after + hidden * outputs + k]
        for unit_of in range(hidden):
            total += weights[after + unit_of * outputs + k] * values[INPUTS + unit_of]
        values[INPUTS + hidden + k] = sigmoid(total)


@compiled
def _learn(
    weights: Any,
    hidden: Any,
    outputs: Any,
    first: Any,
    rate: Any,
    values: Any,
    one: Any,
    other: Any,
    scratch: Any,
) -> None:
    """One step of backpropagation from two outputs, the `first` and the next, towards `one` and `other`, and from no more."""
    after = (INPUTS + 1) * hidden
    for k in range(2):
        y = values[INPUTS + hidden + first + k]
        scratch[k] = (y - (one if k == 0 else other)) * y * (ONE - y)
    for unit_of in range(hidden):
        h, error = values[INPUTS + unit_of], ZERO
        for k in range(2):
            weight = after + unit_of * outputs + first + k
            error += scratch[k] * weights[weight]
            weights[weight] -= rate * scratch[k] * h
        error = error * h * (ONE - h)
        for i in range(INPUTS):
            weights[i * hidden + unit_of] -= rate * error * values[i]
        weights[INPUTS * hidden + unit_of] -= rate * error
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
        part: Any, fitter: OneGenome, other: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                child[module, weight] = (
                    fitter[module, weight] if gate < 0.5 else other[module, weight]
                )
        for mutation in range(min(part.mutations, draws.shape[0])):
            weight = int(draws[mutation, 1] * child.size)
            child[weight // child.shape[1], weight % child.shape[1]] += np.float32(
                (2.0 * draws[mutation, 2] - 1.0) * part.size
            )

    @staticmethod
    def oracle(part: Any, fitter: Any, other: Any, draws: Any, gate: float) -> Any:
        child = [list(module) for module in (fitter if gate < 0.5 else other)]
        for _, place, size, _ in draws[: part.mutations]:
            module, weight = divmod(int(place * len(child) * len(child[0])), len(child[0]))
            child[module][weight] += (2 * size - 1) * part.size
        return child
