"""The model of double pole balancing without velocities, which needs networks with memory.

    baldwinlab run stanley-miikkulainen-2002:poles-without-velocities \\
        --set evolution.generations=3 --runs 1

Cart, poles and forces are those of `double_pole.py`. A network senses the position of the cart,
both angles and a bias. It needs memory to know the direction of movement, so networks are
recurrent. A link may have any source and any target except an input. In each step, all nodes are
updated at the same time, from the current inputs and from the values of nodes in the previous step.
The initial values are 0. The value of a node without incoming links stays 0.

Fitness is that of Gruau, which rewards poles at rest: 0.1 t / 1000 + 0.9 f. Here, t is the number
of balanced steps, up to 1000. f is 0.75 / u, where the unrest u is the sum over the last 100 steps
of |position| + |velocity| of the cart + |angle| + |angular velocity| of the long pole. f is 0 if t
is below 100.

The best network of each generation has two further tests. The first test is whether it balances for
100,000 steps. If it does, the second test counts the start states, of 625, from which the network
balances for 1000 steps. A network that balances from at least 200 start states has solved the task.

All numbers are from memory. The simultaneous update of nodes follows the authors' program, from
memory. Before the first step, that program repeats the update until the output has an input. The
share of recurrent links among new links is not in the paper. Our choice is to draw any pair of
nodes.

References
----------
Stanley and Miikkulainen 2002, section 4.3 and its tables (33,184 networks and 286 start states on
average in 20 runs).
F. Gruau, D. Whitley and L. Pyeatt, "A comparison between cellular encoding and direct encoding for
genetic neural networks", Genetic Programming 1996, for fitness and start states.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import ClassVar, Final

import numpy as np

from baldwinlab.models import kit
from baldwinlab.models.neat import network_model
from baldwinlab.models.neat.balancing import N_UNREST_STEPS
from baldwinlab.models.neat.cart_pole import CART_POSITION, LONG_ANGLE, SHORT_ANGLE
from baldwinlab.models.neat.double_pole import INITIAL_STATE, Poles
from baldwinlab.parts import Field, LifeResults, Variable

# Number of start states from which a solution must balance.
MIN_BALANCED_STARTS: Final = 200
# Constants of Gruau's fitness: 0.1 t / 1000 + 0.9 f, with f = 0.75 / u.
STEPS_SHARE: Final = 0.1
REST_SHARE: Final = 0.9
REST_SCALE: Final = 0.75
# Values of a start state in each of the four ranges, as shares of the range.
START_SHARES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)
# Limits of position (m), velocity (m/s), angle (rad) and angular velocity (rad/s) in both
# directions, of the cart and the long pole.
START_LIMITS: Final = (2.16, 1.35, np.radians(3.6), np.radians(8.6))
START_VALUES: Final = [
    [(2 * share - 1) * limit for share in START_SHARES] for limit in START_LIMITS
]
# The short pole is upright and at rest.
START_STATES: Final = [[*values, 0.0, 0.0] for values in product(*START_VALUES)]


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

    has_loops: ClassVar[bool] = True
    # The position of the cart and both angles.
    sensed_entries: ClassVar[tuple[int, ...]] = (CART_POSITION, LONG_ANGLE, SHORT_ANGLE)
    n_inputs: ClassVar[int] = len(sensed_entries)
    defaults = {
        "population": {"size": 1000},
        "evolution": {"generations": 100, "selection": "species", "variation": "neat"},
        "record": {"genome_every": 50},
    }
    payoff = "Gruau's fitness"
    records = {
        "balanced": Variable.integer("steps", "steps balanced in the trial for fitness"),
        "proven": Variable.integer(
            "steps",
            "steps that the best network of the generation balanced in the longer trial, else 0",
        ),
        "generalises": Variable.integer(
            "",
            "number of start states, of 625, from which it balances after the longer trial, else 0",
        ),
        **network_model.NETWORK_RECORDS,
    }
    measures = network_model.measure_solutions(
        lambda runs: runs["generalises"] >= MIN_BALANCED_STARTS,
        {"generalises": "number of start states, of 625, from which the first solution balances"},
    )

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        graphs = genomes[:, :, 0]
        trial_results = self.balance_networks(graphs, [INITIAL_STATE], self.max_steps)
        # [run, agent]: from the single initial state.
        n_steps = trial_results.n_steps[..., 0]
        unrest = trial_results.unrest[..., 0]
        has_rest = (n_steps >= N_UNREST_STEPS) & (unrest > 0)
        # The term f of the fitness.
        rest = np.divide(REST_SCALE, unrest, out=np.zeros_like(unrest), where=has_rest)
        fitness = STEPS_SHARE * n_steps / self.max_steps + REST_SHARE * rest
        endured_steps = np.zeros(n_steps.shape, np.int32)
        n_balanced_starts = np.zeros(n_steps.shape, np.int32)
        for row, best in enumerate(fitness.argmax(axis=1)):
            # [1, 1, entry]: one run with one agent.
            champion = graphs[row : row + 1, best : best + 1]
            long_trial = self.balance_networks(champion, [INITIAL_STATE], self.endurance_steps)
            endured_steps[row, best] = long_trial.n_steps.item()
            if endured_steps[row, best] == self.endurance_steps:
                start_trials = self.balance_networks(champion, START_STATES, self.max_steps)
                n_balanced_starts[row, best] = (start_trials.n_steps == self.max_steps).sum()
        records = {
            "balanced": n_steps,
            "proven": endured_steps,
            "generalises": n_balanced_starts,
            **network_model.record_networks(graphs),
        }
        return self.make_results(fitness, records)
