"""The model of double pole balancing with velocities, the second task of NEAT.

    baldwinlab run neat-poles --set evolution.generations=5 neat_poles.max_steps=500 --runs 2

A cart on a track carries two poles of different lengths on hinges. A network senses the positions
and the velocities of the cart and the poles. Every 0.02 s, its output sets the force on the cart,
from -10 to 10 N. Fitness is the number of these 0.02 s steps in which the cart stays on its track
and both poles stay within 36 degrees of upright. A network that reaches the maximum number of steps
has solved the task. `balancing.py` has the compiled code. `double_pole_no_velocities.py` shares the
class `Poles`.

Track, lengths, masses and steps follow section 4.3 of Stanley and Miikkulainen 2002 and its tables.
In the paper, 120 runs evaluate 3,578 networks in 24 generations on average. The scaling of the
inputs and the initial angle are those of the authors' program, from memory.

References
----------
Stanley and Miikkulainen 2002.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Final

import numpy as np

from baldwinlab.engine import poison
from baldwinlab.evolution.neat.genome import SIGMOID_SLOPE
from baldwinlab.models import kit
from baldwinlab.models.neat import balancing, network_model
from baldwinlab.models.neat.cart_pole import STATE_SIZE, WORKSPACE_ROWS
from baldwinlab.parts import Field, LifeResults, Variable

# Initial state. The angle of the long pole is 0.07 rad.
INITIAL_STATE: Final = (0.0, 0.0, 0.07, 0.0, 0.0, 0.0)


class Poles(network_model.NetworkModel):
    """Base class of the models with and without velocities."""

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
    founder_weight_range: float = network_model.FOUNDER_WEIGHT_RANGE

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
    ) -> balancing.BalanceResults:
        """Balance the poles with each network from each initial state.

        `graphs`: (runs, agents, entries).
        """
        n_runs, n_agents = graphs.shape[:2]
        shape = (n_runs, n_agents, len(initial_states))
        results = balancing.BalanceResults(
            n_steps=poison.empty(shape, np.int64), unrest=poison.empty(shape)
        )
        settings = balancing.BalanceSettings(
            sensed_entries=np.array(self.sensed_entries),
            has_loops=self.has_loops,
            max_steps=max_steps,
            sigmoid_slope=np.float32(self.sigmoid_slope),
        )
        # A hidden node needs a link, so there are at most `max_links` hidden nodes.
        n_nodes = self.n_inputs + self.max_links + network_model.N_OUTPUTS
        scratch = balancing.BalanceScratch(
            values=poison.empty((2, n_nodes), np.float32),
            links=poison.empty((2, self.max_links, balancing.LINK_SIZE), np.float32),
            workspace=poison.empty((WORKSPACE_ROWS, STATE_SIZE)),
            recent_unrest=poison.empty(balancing.N_UNREST_STEPS),
        )
        balancing.balance(
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
        **network_model.NETWORK_RECORDS,
    }
    measures = network_model.measure_solutions(lambda runs: runs["solves"] == 1)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        graphs = genomes[:, :, 0]
        results = self.balance_networks(graphs, [INITIAL_STATE], self.max_steps)
        # [run, agent]: from the single initial state.
        n_steps = results.n_steps[..., 0]
        records = {"solves": n_steps == self.max_steps, **network_model.record_networks(graphs)}
        return self.make_results(n_steps.astype(np.float64), records)
