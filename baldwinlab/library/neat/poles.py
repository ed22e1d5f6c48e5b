"""Two poles on a cart, which must be kept from falling: the harder task of NEAT.

    baldwinlab run neat-poles --set evolution.generations=5 neat_poles.longest=500 --runs 2

A cart on a track carries two poles, hinged, of different lengths. A network senses the places and the velocities of cart and
poles, and says every 0.02 s with what force the cart is pushed, from -10 to 10 N. Fitness is for how many such steps the cart
stays on its track and both poles within 36 degrees of upright; who does for the longest time that is tried has solved it.

Sources: Stanley and Miikkulainen 2002, section 4.3 and its tables (track, lengths, masses, steps; 3,578 networks and 24
generations on average in 120 runs); A. P. Wieland, "Evolving neural network controllers for unstable systems", IJCNN 1991, for
the equations of motion. To our memory as in the authors' program are the scale of the senses and the angle at the start. The
paper's other task, without velocities, needs networks with loops, which these are not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import polynomial, sigmoid
from baldwinlab.engine.jit import compiled, entry
from baldwinlab.library.neat.graphs import entries, list_links, minimal
from baldwinlab.library.neat.solutions import SHAPE, of_solutions, shape_of
from baldwinlab.parts import FOUNDER, OF_AGENT, Field, Lives, Measure, Model, Variable

INPUTS: Final = 6  # place and velocity of the cart, and angle and angular velocity of either pole
SCALE: Final = (4.8, 2.0, 0.52, 2.0, 0.52, 2.0)  # what the state is divided by, to be sensed
TRACK, UPRIGHT, START = 2.4, 36 * np.pi / 180, 0.07  # m either way; rad either way; rad of the long pole
CART, MASSES, HALVES = 1.0, (0.1, 0.01), (0.5, 0.05)  # kg, kg, and half of the lengths in m: 1 m and 0.1 m
FORCE, GRAVITY, HINGE = 10.0, -9.8, 2e-6  # N, m/s^2, friction of a hinge
STEP: Final = 0.01  # s, of which there are two to a push
SINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 2))) for k in range(9, -1, -1))  # in powers of the square
COSINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 1))) for k in range(10, -1, -1))


class NeatPoles(Model, name="neat-poles"):
    """Networks that grow until they keep two poles upright."""

    longest: int = Field(100_000, ge=1, le=1_000_000, description="steps of 0.02 s for which the poles must stay upright")
    links: int = Field(100, ge=INPUTS + 1, le=1000, description="links for which a genome has room, enabled or not (ours)")
    steepness: float = Field(4.9, gt=0, le=1000, description="a node answers 1 / (1 + exp(-steepness x total))")
    newborn_range: float = Field(1.0, ge=0, le=1000, description="weights of founders are of U(-this, this) (ours)")

    graphs: ClassVar[bool] = True
    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 150},
        "evolution": {"generations": 100, "selection": "species", "variation": "neat"},
        "record": {"genome_every": 10},
    }
    payoff: ClassVar[str] = "steps balanced"
    records: ClassVar[Mapping[str, Variable]] = {
        "solves": Variable(OF_AGENT, np.int32, "", "1 where both poles stayed upright for the longest time, else 0"),
        **SHAPE,
    }
    measures: ClassVar[Mapping[str, Measure]] = of_solutions(lambda runs: runs["solves"] == 1)

    @property
    def steps(self) -> int:
        return self.longest

    def without_learner(self) -> NeatPoles:
        return self

    def weights(self) -> int:
        return entries(self.links)

    def founders(self, agents: int, moment: Any) -> npt.NDArray[np.float32]:
        draws = moment.uniforms(FOUNDER, (agents, INPUTS + 1))[:, :, 0]
        return minimal(INPUTS + 1, 1, self.links, (2 * draws - 1) * self.newborn_range)[:, None]

    def live(self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]) -> Lives:
        graphs = np.ascontiguousarray(genomes[:, :, 0])
        balanced = np.empty(graphs.shape[:2], np.int64)
        units = INPUTS + self.links + 1
        plan = np.empty((2, self.links, 3), np.float32)
        motion = np.empty((7, INPUTS))
        balance(graphs, self.longest, np.float32(self.steepness), np.empty((2, units), np.float32), plan, motion, balanced)
        energy = balanced.astype(np.float64)
        records = {"solves": (balanced == self.longest).astype(np.int32), **shape_of(graphs)}
        return Lives(energy, np.zeros_like(energy), None, records)


@entry
def balance(graphs: Any, longest: int, steepness: Any, units: Any, plan: Any, motion: Any, balanced: Any) -> None:
    """Fill `balanced` [run, agent] with the steps until something falls.

    `units` [2, unit], `plan` [2, link, 3] and `motion` [7, 6] are scratch.
    """
    for run in range(graphs.shape[0]):
        for agent in range(graphs.shape[1]):
            links = plan_answer(graphs[run, agent], plan[0], plan[1], units[1])
            state, step = motion[0], 0
            for part in range(INPUTS):
                state[part] = 0.0
            state[2] = START
            while step < longest and _stands(state):
                push = FORCE * (2.0 * np.float64(_answer(plan[1], links, steepness, state, units[0])) - 1.0)
                move(state, push, STEP, HINGE, motion)
                move(state, push, STEP, HINGE, motion)
                step += int(_stands(state))
            balanced[run, agent] = step


@compiled
def _stands(state: Any) -> bool:
    """Whether the cart is on its track and both poles are upright."""
    return bool(abs(state[0]) <= TRACK and abs(state[2]) <= UPRIGHT and abs(state[4]) <= UPRIGHT)


@compiled
def plan_answer(graph: Any, found: Any, plan: Any, done: Any) -> int:
    """Fill `plan` [link, (from row, to row, weight)] with the enabled links, each after all those that its source hears.

    How many there are. Links to a node stand together, in the order of the genome. `found`, of the same shape, and
    `done` [row] are scratch.
    """
    count, planned, more = list_links(graph, INPUTS, 1, done.size, found), 0, True
    for row in range(done.size):
        done[row] = 1.0 if row < INPUTS else 0.0
    while more:
        more = False
        for row in range(INPUTS, done.size):
            if done[row] == 0.0 and _may_answer(found, count, row, done):
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
def _answer(plan: Any, links: int, steepness: Any, state: Any, values: Any) -> Any:
    """What the output says, in (0, 1); a node that hears nobody says 1/2, and row -1 is the bias. `values` [row] is scratch."""
    for row in range(values.size):
        values[row] = np.float32(state[row] / SCALE[row]) if row < INPUTS else np.float32(0.5)
    link = 0
    while link < links:
        target, total = int(plan[link, 1]), np.float32(0)
        while link < links and int(plan[link, 1]) == target:
            source = int(plan[link, 0])
            total += plan[link, 2] * (np.float32(1) if source < 0 else values[source])
            link += 1
        values[target] = sigmoid(steepness * total)
    return values[values.size - 1]


@compiled
def move(state: Any, push: float, step: float, friction: float, motion: Any) -> None:
    """One step of Runge and Kutta's fourth order. `motion` [7, 6] is scratch from row 1 on."""
    point = motion[1]
    _slope(state, push, friction, motion[2])
    for stage in range(1, 4):
        share = step if stage == 3 else 0.5 * step
        for part in range(INPUTS):
            point[part] = state[part] + share * motion[1 + stage, part]
        _slope(point, push, friction, motion[2 + stage])
    for part in range(INPUTS):
        inner = motion[3, part] + motion[4, part]
        state[part] += step / 6.0 * ((motion[2, part] + motion[5, part]) + 2.0 * inner)


@compiled
def _slope(state: Any, push: float, friction: float, slope: Any) -> None:
    """The rates at which cart and poles change (Wieland 1991)."""
    force, mass = push, CART
    for pole in range(2):
        angle, turning = state[2 + 2 * pole], state[3 + 2 * pole]
        sine, cosine = sine_of(angle), cosine_of(angle)
        drag = friction * turning / (MASSES[pole] * HALVES[pole])
        force += MASSES[pole] * (HALVES[pole] * turning * turning * sine + 0.75 * cosine * (drag + GRAVITY * sine))
        mass += MASSES[pole] * (1.0 - 0.75 * cosine * cosine)
    slope[0], slope[1] = state[1], force / mass
    for pole in range(2):
        angle, turning = state[2 + 2 * pole], state[3 + 2 * pole]
        drag = friction * turning / (MASSES[pole] * HALVES[pole])
        slope[2 + 2 * pole] = turning
        slope[3 + 2 * pole] = -0.75 / HALVES[pole] * (slope[1] * cosine_of(angle) + GRAVITY * sine_of(angle) + drag)


@compiled
def sine_of(angle: float) -> float:
    """Of an angle between -1.5 and 1.5, within 1e-15: products alone, so that the bits are those of any machine."""
    return angle * polynomial(angle * angle, SINE)


@compiled
def cosine_of(angle: float) -> float:
    """Of an angle between -1.5 and 1.5, within 1e-15."""
    return polynomial(angle * angle, COSINE)
