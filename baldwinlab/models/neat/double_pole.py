"""Two poles on a cart, which must be kept from falling: the harder task of NEAT.

    baldwinlab run neat-poles --set evolution.generations=5 neat_poles.max_steps=500 --runs 2

A cart on a track carries two poles, hinged, of different lengths. A network senses the places and
the velocities of cart and poles, and says every 0.02 s with what force the cart is pushed, from -10
to 10 N. Fitness is for how many such steps the cart stays on its track and both poles within 36
degrees of upright; who does for the longest time that is tried has solved it. What it shares with
the task without velocities, `unseen_velocities.py`, is here, too.

Sources: Stanley and Miikkulainen 2002, section 4.3 and its tables (track, lengths, masses, steps;
3,578 networks and 24 generations on average in 120 runs). To our memory as in the authors' program
are the scale of the senses and the angle at the start.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final, Self

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.evolution.neat.genome import (
    INFINITE_GENES,
    entries,
    list_links,
    minimal,
    require_neat,
)
from baldwinlab.models.neat.cart_pole import FORCE, HINGE, PARTS, STEP, move, stands
from baldwinlab.models.neat.measures import SHAPE, of_solutions, shape_of
from baldwinlab.parts import FOUNDER, OF_AGENT, Field, LifeResults, Measure, Model, Variable

SCALE: Final = (4.8, 2.0, 0.52, 2.0, 0.52, 2.0)  # what the state is divided by, to be sensed
START: Final = (0.0, 0.0, 0.07, 0.0, 0.0, 0.0)  # the long pole leans, in rad
LAST: Final = 100  # steps whose unrest is told


class Poles(Model):
    """What the tasks have in common."""

    max_steps: int = Field(
        100_000,
        ge=1,
        le=1_000_000,
        description="Number of steps of 0.02 s for which the poles must stay upright.",
    )
    max_links: int = Field(
        100,
        ge=PARTS + 1,
        le=1000,
        description="Maximum number of links in a genome (our choice).",
    )
    sigmoid_slope: float = Field(
        4.9,
        gt=0,
        le=1000,
        description="Slope of the sigmoid: output = 1 / (1 + exp(-steepness * input)).",
    )
    founder_weight_range: float = Field(
        1.0,
        ge=0,
        le=1000,
        description="Limit R of the founders' weights, drawn from U(-R, R) (our choice).",
    )

    graphs: ClassVar[bool] = True
    infinite_genes: ClassVar[tuple[int, ...]] = INFINITE_GENES
    loops: ClassVar[bool] = False  # whether links may lead back, and nodes remember
    sensed: ClassVar[tuple[int, ...]]  # parts of the state

    def without_learning(self) -> Self:
        return self

    @property
    def steps(self) -> int:
        return self.max_steps

    def check(self, experiment: Any) -> None:
        require_neat(experiment, f"model = {self.name!r}")

    def weights(self) -> int:
        return entries(self.max_links)

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        inputs = len(self.sensed) + 1  # and the bias
        draws = key.uniforms(FOUNDER, (agents, inputs))[:, :, 0]
        return minimal(inputs, 1, self.max_links, (2 * draws - 1) * self.founder_weight_range)[
            :, None
        ]

    def balanced(
        self, graphs: npt.NDArray[np.float32], starts: Sequence[Sequence[float]], longest: int
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
        """Of each network, [run, agent, entry], from each start state: the steps until something falls, and `balance`'s unrest.

        Both are [run, agent, start].
        """
        shape = (*graphs.shape[:2], len(starts))
        steps, unrest = poison.empty(shape, np.int64), poison.empty(shape)
        units = poison.empty((2, len(self.sensed) + self.max_links + 1), np.float32)
        scratch = (
            units,
            poison.empty((2, self.max_links, 3), np.float32),
            poison.empty((7, PARTS)),
            poison.empty(LAST),
        )
        how = (np.array(self.sensed), self.loops, longest, np.float32(self.sigmoid_slope))
        balance(
            np.ascontiguousarray(graphs), np.array(starts, float), *how, *scratch, steps, unrest
        )
        return steps, unrest


class NeatPoles(Poles, name="neat-poles"):
    """Networks with evolving topology that balance two poles on a cart."""

    sensed: ClassVar[tuple[int, ...]] = tuple(range(PARTS))
    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 150},
        "evolution": {"generations": 100, "selection": "species", "variation": "neat"},
        "record": {"genome_every": 10},
    }
    payoff: ClassVar[str] = "steps balanced"
    records: ClassVar[Mapping[str, Variable]] = {
        "solves": Variable(
            OF_AGENT, np.int32, "", "1 if both poles stayed upright for all steps, else 0"
        ),
        **SHAPE,
    }
    measures: ClassVar[Mapping[str, Measure]] = of_solutions(lambda runs: runs["solves"] == 1)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        graphs = genomes[:, :, 0]
        steps = self.balanced(graphs, [START], self.max_steps)[0][..., 0]
        energy = steps.astype(np.float64)
        records = {"solves": (steps == self.max_steps).astype(np.int32), **shape_of(graphs)}
        return LifeResults(energy, np.zeros_like(energy), None, records)


@jit_entry_point
def balance(
    graphs: Any, starts: Any, sensed: Any, loops: bool, longest: int, steepness: Any,
    units: Any, plan: Any, motion: Any, recent: Any, steps: Any, unrest: Any,
) -> None:  # fmt: skip
    """Fill `steps` [run, agent, start] with the steps until something falls, and `unrest` with how restless the last were.

    Unrest is |place| + |velocity| of the cart + |angle| + |angular velocity| of the long pole, over
    the last `MAX_GENERATIONS` steps. `units` [2, unit], `plan` [2, link, 3], `motion` [7, 6] and `recent`
    [LAST] are scratch.
    """
    for run in range(graphs.shape[0]):
        for agent in range(graphs.shape[1]):
            links = plan_answer(graphs[run, agent], sensed.size, loops, plan[0], plan[1], units[1])
            for start in range(starts.shape[0]):
                _begin(starts[start], loops, units, motion[0], recent)
                lived = _live(
                    plan[1], links, sensed, loops, longest, steepness, units, motion, recent
                )
                steps[run, agent, start], total = lived, 0.0
                for step in range(LAST):
                    total += recent[step]
                unrest[run, agent, start] = total


@compiled
def _begin(start: Any, loops: bool, units: Any, state: Any, recent: Any) -> None:
    """A node that hears nobody says 1/2; where there are loops all have said 0 before life."""
    for part in range(PARTS):
        state[part] = start[part]
    for row in range(units.shape[1]):
        units[0, row] = units[1, row] = np.float32(0) if loops else np.float32(0.5)
    for step in range(LAST):
        recent[step] = 0.0


@compiled
def _live(
    plan: Any,
    links: int,
    sensed: Any,
    loops: bool,
    longest: int,
    steepness: Any,
    units: Any,
    motion: Any,
    recent: Any,
) -> int:
    """The steps until something falls."""
    state, step, heard, said = motion[0], 0, units[1 if loops else 0], units[0]
    while step < longest and stands(state):
        push = FORCE * (
            2.0 * np.float64(answer_once(plan, links, steepness, sensed, state, heard, said)) - 1.0
        )
        if loops:
            for row in range(said.size):
                heard[row] = said[row]
        move(state, push, STEP, HINGE, motion)
        move(state, push, STEP, HINGE, motion)
        if stands(state):
            recent[step % LAST] = (abs(state[0]) + abs(state[1])) + (abs(state[2]) + abs(state[3]))
            step += 1
    return step


@compiled
def plan_answer(graph: Any, inputs: int, loops: bool, found: Any, plan: Any, done: Any) -> int:
    """Fill `plan` [link, (from row, to row, weight)] with the enabled links, each after all those that its source hears.

    Where there may be `loops` they have no such order. How many there are. Links to a node stand
    together, in the order of the genome. `inputs` are those without the bias. `found`, of the same
    shape, and `done` [row] are scratch.
    """
    count, planned, more = list_links(graph, inputs, 1, done.size, found), 0, True
    for row in range(done.size):
        done[row] = 1.0 if row < inputs else 0.0
    while more:
        more = False
        for row in range(inputs, done.size):
            if done[row] == 0.0 and (loops or _may_answer(found, count, row, done)):
                done[row], more = 1.0, True
                for link in range(count):
                    if found[link, 1] == row:
                        for entry_of in range(3):
                            plan[planned, entry_of] = found[link, entry_of]
                        planned += 1
    return planned


@compiled
def _may_answer(found: Any, count: int, row: int, done: Any) -> bool:
    """Whether all have answered that a node hears."""
    heard = True
    for link in range(count):
        if found[link, 1] == row and found[link, 0] >= 0.0:
            heard = heard and done[int(found[link, 0])] > 0.0
    return heard


@compiled
def answer_once(
    plan: Any, links: int, steepness: Any, sensed: Any, state: Any, heard: Any, said: Any
) -> Any:
    """What the output says, in (0, 1): every node that hears anybody answers what it hears into `said` [row].

    `heard` [row] is `said` itself where nodes answer one after the other; else what they said a
    step before, but for what is sensed, which all hear at once. Row -1 is the bias.
    """
    for row in range(sensed.size):
        heard[row] = said[row] = np.float32(state[sensed[row]] / SCALE[sensed[row]])
    link = 0
    while link < links:
        target, total = int(plan[link, 1]), np.float32(0)
        while link < links and int(plan[link, 1]) == target:
            source = int(plan[link, 0])
            total += plan[link, 2] * (np.float32(1) if source < 0 else heard[source])
            link += 1
        said[target] = sigmoid(steepness * total)
    return said[said.size - 1]
