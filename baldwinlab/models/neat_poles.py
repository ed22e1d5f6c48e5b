"""Models of double pole balancing with and without velocities, the second task of NEAT.

    baldwinlab run neat-poles --set evolution.generations=5 neat_poles.max_steps=500 --runs 2
    baldwinlab run stanley-miikkulainen-2002:poles-without-velocities \\
        --set evolution.generations=3 --runs 1

A cart on a track carries two poles of different lengths on hinges. Every 0.02 s, the output of a
network sets the force on the cart, from -10 to 10 N. The cart must stay on its track, and both
poles within 36 degrees of upright. The module `pole_balancing` has the compiled code.

With velocities, a network senses the positions and the velocities of the cart and the poles.
Fitness is the number of balanced steps of 0.02 s. A network that reaches the maximum number of
steps has solved the task. In the paper, 120 runs evaluate 3,578 networks in 24 generations on
average. The scaling of the inputs and the initial angle are those of the authors' program, from
memory.

Without velocities, a network senses the position of the cart, both angles and a bias. It needs
memory to know the direction of movement, so networks are recurrent. A link may have any source and
any target except an input. In each step, all nodes are updated at the same time, from the current
inputs and from the values of nodes in the previous step. The initial values are 0. The value of a
node without incoming links stays 0.

Without velocities, fitness is that of Gruau, which rewards poles at rest: 0.1 t / 1000 + 0.9 f.
Here, t is the number of balanced steps, up to 1000. f is 0.75 / u, where the unrest u is the sum
over the last 100 steps of |position| + |velocity| of the cart + |angle| + |angular velocity| of the
long pole. f is 0 if t is below 100.

The best network of each generation has two further tests. In the first test, the network must
balance for 100,000 steps. If it succeeds, the second test counts the start states, of 625, from
which the network balances for 1000 steps. A network that balances from at least 200 start states
has solved the task.

All constants of the task without velocities are from memory. The simultaneous update of nodes
follows the authors' program, from memory. Unlike this model, that program repeats the update before
the first step, until the output has an input. The paper does not give the fraction of recurrent
links among new links. Our choice is to draw any pair of nodes.

References
----------
Stanley and Miikkulainen 2002, section 4.3 and its tables (without velocities, 33,184 networks and
286 start states on average in 20 runs).
F. Gruau, D. Whitley and L. Pyeatt, "A comparison between cellular encoding and direct encoding for
genetic neural networks", Genetic Programming 1996, for fitness and start states.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import ClassVar, Final

import numpy as np

from baldwinlab.engine import poison
from baldwinlab.evolution.neat.genome import SIGMOID_SLOPE
from baldwinlab.models import kit, neat_networks, pole_balancing
from baldwinlab.models.pole_balancing import (
    CART_POSITION,
    LONG_ANGLE,
    N_UNREST_STEPS,
    SHORT_ANGLE,
    STATE_SIZE,
    WORKSPACE_ROWS,
)
from baldwinlab.parts import Field, LifeResults, Variable

# Initial state, in the order of `pole_balancing.py`. The angle of the long pole is 0.07 rad.
INITIAL_STATE: Final = (0.0, 0.0, 0.07, 0.0, 0.0, 0.0)
# Number of start states from which a solution must balance.
MIN_BALANCED_STARTS: Final = 200
# Constants of Gruau's fitness: 0.1 t / `max_steps` + 0.9 f, with f = 0.75 / u.
STEPS_SHARE: Final = 0.1
REST_SHARE: Final = 0.9
REST_SCALE: Final = 0.75
# Start values as fractions of a range [-limit, limit]: 0 is -limit, 1 is limit.
START_SHARES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)
# Limits of position (m) and velocity (m/s) of the cart, and of angle (rad) and angular velocity
# (rad/s) of the long pole.
START_LIMITS: Final = (2.16, 1.35, np.radians(3.6), np.radians(8.6))
START_VALUES: Final = [
    [(2 * share - 1) * limit for share in START_SHARES] for limit in START_LIMITS
]
# [state, entry]: the 5^4 combinations. The two last zeros are the short pole, upright and at rest.
START_STATES: Final = [[*values, 0.0, 0.0] for values in product(*START_VALUES)]


class Poles(neat_networks.NetworkModel):
    """Base class of the two models of pole balancing."""

    max_steps: int = Field(
        100_000,
        ge=1,
        le=1_000_000,
        description="Number of steps of 0.02 s for which the poles must stay upright.",
    )
    max_links: int = Field(
        100,
        ge=STATE_SIZE + 1,
        le=1000,
        description="Maximum number of links in a genome (our choice).",
    )
    sigmoid_slope: float = SIGMOID_SLOPE
    founder_weight_range: float = neat_networks.FOUNDER_WEIGHT_RANGE

    # Whether networks may be recurrent.
    has_loops: ClassVar[bool] = False
    # Indices of the entries of a state that the network senses.
    sensed_entries: ClassVar[tuple[int, ...]]

    lifetime_steps = "max_steps"

    def balance_networks(
        self,
        graphs: kit.Genomes,
        initial_states: Sequence[Sequence[float]],
        max_steps: int,
    ) -> pole_balancing.BalanceResults:
        """Balance the poles with each network [run, agent, entry] from each initial state."""
        n_runs, n_agents = graphs.shape[:2]
        shape = (n_runs, n_agents, len(initial_states))
        results = pole_balancing.BalanceResults(
            n_steps=poison.empty(shape, np.int64), unrest=poison.empty(shape)
        )
        settings = pole_balancing.BalanceSettings(
            sensed_entries=np.array(self.sensed_entries),
            has_loops=self.has_loops,
            max_steps=max_steps,
            sigmoid_slope=np.float32(self.sigmoid_slope),
        )
        # A hidden node needs a link, so there are at most `max_links` hidden nodes.
        n_nodes = self.n_inputs + self.max_links + neat_networks.N_OUTPUTS
        scratch = pole_balancing.BalanceScratch(
            values=poison.empty((2, n_nodes), np.float32),
            links=poison.empty((2, self.max_links, pole_balancing.LINK_SIZE), np.float32),
            workspace=poison.empty((WORKSPACE_ROWS, STATE_SIZE)),
            recent_unrest=poison.empty(pole_balancing.N_UNREST_STEPS),
        )
        pole_balancing.balance(
            settings,
            np.ascontiguousarray(graphs),
            np.array(initial_states, float),
            scratch,
            results,
        )
        return results


class NeatPoles(Poles, name="neat-poles"):
    """Networks with evolving topology that balance two poles on a cart."""

    sensed_entries: ClassVar[tuple[int, ...]] = tuple(range(STATE_SIZE))
    n_inputs: ClassVar[int] = len(sensed_entries)
    defaults = {
        "population": {"size": 150},
        "evolution": {"generations": 100, "selection": "species", "variation": "neat"},
        "record": {"genome_every": 10},
    }
    payoff = "steps balanced"
    records = {
        "solves": Variable.integer("", "1 if both poles stayed upright for all steps, else 0"),
        **neat_networks.NETWORK_RECORDS,
    }
    measures = neat_networks.measure_solutions(lambda runs: runs["solves"] == 1)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        graphs = genomes[:, :, 0]
        results = self.balance_networks(graphs, [INITIAL_STATE], self.max_steps)
        # [run, agent], because there is one initial state.
        n_steps = results.n_steps[..., 0]
        records = {"solves": n_steps == self.max_steps, **neat_networks.record_networks(graphs)}
        return self.make_results(n_steps.astype(np.float64), records)


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
        **neat_networks.NETWORK_RECORDS,
    }
    measures = neat_networks.measure_solutions(
        lambda runs: runs["generalises"] >= MIN_BALANCED_STARTS,
        {"generalises": "number of start states, of 625, from which the first solution balances"},
    )

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        graphs = genomes[:, :, 0]
        trial_results = self.balance_networks(graphs, [INITIAL_STATE], self.max_steps)
        # [run, agent], because there is one initial state.
        n_steps = trial_results.n_steps[..., 0]
        unrest = trial_results.unrest[..., 0]
        has_rest = (n_steps >= N_UNREST_STEPS) & (unrest > 0)
        # The term f of the fitness, 0 without rest.
        rest = np.divide(REST_SCALE, unrest, out=np.zeros_like(unrest), where=has_rest)
        fitness = STEPS_SHARE * n_steps / self.max_steps + REST_SHARE * rest
        endured_steps = np.zeros(n_steps.shape, np.int32)
        n_balanced_starts = np.zeros(n_steps.shape, np.int32)
        for row, best in enumerate(fitness.argmax(axis=1)):
            # [1, 1, entry]: the best agent of one run.
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
            **neat_networks.record_networks(graphs),
        }
        return self.make_results(fitness, records)
