"""Two poles on a cart whose velocities are not sensed: the task of NEAT that needs networks with a memory.

    baldwinlab run stanley-miikkulainen-2002:poles-without-velocities --set evolution.generations=3 --runs 1

Cart, poles and pushes are those of `poles.py`. A network senses the place of the cart, both angles and a bias, so it must
remember something to tell whither things move: its links may lead anywhere but to an input, back and to the same node, too. In a
step all nodes answer at once. They hear what is sensed now, and what nodes said a step ago; before life all have said 0, which a
node that hears nobody goes on to.

Fitness is Gruau's, which rewards rest, so that poles are not kept up by swinging: 0.1 t / 1000 + 0.9 f, where t of 1000 steps are
balanced, and f is 0.75 / the sum over the last 100 of |place| + |velocity| + |angle| + |angular velocity| of cart and long
pole, or 0 where t is below 100. The best network of each generation is tried further: whether it balances for 100,000 steps, and
if so, from how many of 625 start states it does for 1000. From 200 on it has solved the task.

Sources: Stanley and Miikkulainen 2002, section 4.3 and its tables (33,184 networks and 286 start states on average in 20 runs);
F. Gruau, D. Whitley and L. Pyeatt, "A comparison between cellular encoding and direct encoding for genetic neural networks",
Genetic Programming 1996, for fitness and start states. All numbers are from memory. That nodes answer once a step is as, to
our memory, in the authors' program, which before the first step goes on until the output has heard anything. How many of the new
links lead back is open, and read so: as many as it comes to where any two nodes may be joined.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.models.neat.double_pole import LAST, START, Poles
from baldwinlab.models.neat.measures import SHAPE, of_solutions, shape_of
from baldwinlab.parts import OF_AGENT, Field, LifeResults, Measure, Variable

ENOUGH: Final = 200  # start states
SHARES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)  # where a start state lies in each of the four ranges
RANGES: Final = (
    2.16,
    1.35,
    np.radians(3.6),
    np.radians(8.6),
)  # m, m/s, rad and rad/s either way, of cart and long pole
STARTS: Final = [
    [*((2 * share - 1) * most for share, most in zip(shares, RANGES, strict=True)), 0.0, 0.0]
    for shares in product(SHARES, repeat=len(RANGES))
]


class UnseenVelocities(Poles, name="neat-poles-without-velocities"):
    """Networks with evolving topology that balance two poles without sensing velocities."""

    max_steps: int = Field(
        1000,
        ge=1,
        le=1_000_000,
        description="Number of steps of 0.02 s of a trial for fitness.",
    )
    endurance_steps: int = Field(
        100_000,
        ge=1,
        le=1_000_000,
        description=(
            "Number of steps that the best network of a generation must balance "
            "before the test of generalization."
        ),
    )

    loops: ClassVar[bool] = True
    sensed: ClassVar[tuple[int, ...]] = (0, 2, 4)
    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 1000},
        "evolution": {"generations": 100, "selection": "species", "variation": "neat"},
        "record": {"genome_every": 50},
    }
    payoff: ClassVar[str] = "Gruau's fitness"
    records: ClassVar[Mapping[str, Variable]] = {
        "balanced": Variable(
            OF_AGENT, np.int32, "steps", "steps balanced in the trial for fitness"
        ),
        "proven": Variable(
            OF_AGENT,
            np.int32,
            "steps",
            ("steps that the best network of the generation balanced in the longer trial, else 0"),
        ),
        "generalises": Variable(
            OF_AGENT,
            np.int32,
            "",
            (
                "number of start states, of 625, from which it balances after the longer "
                "trial, else 0"
            ),
        ),
        **SHAPE,
    }
    measures: ClassVar[Mapping[str, Measure]] = of_solutions(
        lambda runs: runs["generalises"] >= ENOUGH,
        {"generalises": "number of start states, of 625, from which the first solution balances"},
    )

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        graphs = genomes[:, :, 0]
        steps, unrest = (found[..., 0] for found in self.balanced(graphs, [START], self.max_steps))
        rest = np.divide(
            0.75, unrest, out=np.zeros_like(unrest), where=(steps >= LAST) & (unrest > 0)
        )
        energy = 0.1 * steps / self.max_steps + 0.9 * rest
        proven, generalises = np.zeros((2, *steps.shape), np.int32)
        for run, best in enumerate(energy.argmax(axis=1)):
            champion = graphs[run : run + 1, best : best + 1]
            proven[run, best] = self.balanced(champion, [START], self.endurance_steps)[0].item()
            if proven[run, best] == self.endurance_steps:
                generalises[run, best] = (
                    self.balanced(champion, STARTS, self.max_steps)[0] == self.max_steps
                ).sum()
        records = {
            "balanced": steps.astype(np.int32),
            "proven": proven,
            "generalises": generalises,
            **shape_of(graphs),
        }
        return LifeResults(energy, np.zeros_like(energy), None, records)
