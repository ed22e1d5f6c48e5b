"""The model of double pole balancing with velocities, the second task of NEAT.

    baldwinlab run neat-poles --set evolution.generations=5 neat_poles.max_steps=500 --runs 2

A cart on a track carries two poles of different lengths on hinges. A network senses the positions
and the velocities of the cart and the poles. Every 0.02 s, its output sets the force on the cart,
from -10 to 10 N. Fitness is the number of these 0.02 s steps in which the cart stays on its track
and both poles stay within 36 degrees of upright. A network that reaches the maximum number of steps
has solved the task. `double_pole_no_velocities.py` shares the code of this module.

Track, lengths, masses and steps follow section 4.3 of Stanley and Miikkulainen 2002 and its tables.
In the paper, 120 runs evaluate 3,578 networks in 24 generations on average. The scaling of the
inputs and the initial angle are those of the authors' program, from memory.

References
----------
Stanley and Miikkulainen 2002.
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
    count_entries,
    list_links,
    make_minimal_graphs,
    require_neat,
)
from baldwinlab.models.neat.cart_pole import (
    HINGE_FRICTION,
    MAX_FORCE,
    STATE_SIZE,
    TIME_STEP,
    is_balanced,
    move,
)
from baldwinlab.models.neat.measures import NETWORK_RECORDS, measure_solutions, record_networks
from baldwinlab.parts import FOUNDER, PER_AGENT_DIMS, Field, LifeResults, Measure, Model, Variable

# Divisors of the state, which give the inputs.
INPUT_SCALES: Final = (4.8, 2.0, 0.52, 2.0, 0.52, 2.0)
# Initial state. The angle of the long pole is 0.07 rad.
INITIAL_STATE: Final = (0.0, 0.0, 0.07, 0.0, 0.0, 0.0)
# Number of final steps of a trial over which the unrest is added up.
N_UNREST_STEPS: Final = 100


class Poles(Model):
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

    has_graph_genomes: ClassVar[bool] = True
    infinite_genes: ClassVar[tuple[int, ...]] = INFINITE_GENES
    # Whether networks may be recurrent.
    loops: ClassVar[bool] = False
    # Indices of the state that are sensed.
    sensed: ClassVar[tuple[int, ...]]

    def without_learning(self) -> Self:
        return self

    @property
    def steps(self) -> int:
        return self.max_steps

    def check(self, experiment: Any) -> None:
        require_neat(experiment, f"model = {self.name!r}")

    def n_weights(self) -> int:
        return count_entries(self.max_links)

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        # The bias is an input.
        inputs = len(self.sensed) + 1
        draws = key.uniforms(FOUNDER, (agents, inputs))[:, :, 0]
        weights = (2 * draws - 1) * self.founder_weight_range
        return make_minimal_graphs(inputs, 1, self.max_links, weights)[:, None]

    def balance_networks(
        self, graphs: npt.NDArray[np.float32], starts: Sequence[Sequence[float]], max_steps: int
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
        """Balance the poles with each network from each initial state.

        Parameters
        ----------
        graphs : array of shape (runs, agents, entries)
            Networks.
        starts : sequence
            Initial states.
        max_steps : int
            Maximum number of steps.

        Returns
        -------
        steps : array of shape (runs, agents, starts)
            Number of steps until the cart leaves its track or a pole falls.
        unrest : array of shape (runs, agents, starts)
            Unrest, as defined in `balance`.
        """
        shape = (*graphs.shape[:2], len(starts))
        steps = poison.empty(shape, np.int64)
        unrest = poison.empty(shape)
        units = poison.empty((2, len(self.sensed) + self.max_links + 1), np.float32)
        scratch = (
            units,
            poison.empty((2, self.max_links, 3), np.float32),
            poison.empty((7, STATE_SIZE)),
            poison.empty(N_UNREST_STEPS),
        )
        settings = (np.array(self.sensed), self.loops, max_steps, np.float32(self.sigmoid_slope))
        balance(
            np.ascontiguousarray(graphs),
            np.array(starts, float),
            *settings,
            *scratch,
            steps,
            unrest,
        )
        return steps, unrest


class NeatPoles(Poles, name="neat-poles"):
    """Networks with evolving topology that balance two poles on a cart."""

    sensed: ClassVar[tuple[int, ...]] = tuple(range(STATE_SIZE))
    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 150},
        "evolution": {"generations": 100, "selection": "species", "variation": "neat"},
        "record": {"genome_every": 10},
    }
    payoff: ClassVar[str] = "steps balanced"
    records: ClassVar[Mapping[str, Variable]] = {
        "solves": Variable(
            PER_AGENT_DIMS, np.int32, "", "1 if both poles stayed upright for all steps, else 0"
        ),
        **NETWORK_RECORDS,
    }
    measures: ClassVar[Mapping[str, Measure]] = measure_solutions(lambda runs: runs["solves"] == 1)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        graphs = genomes[:, :, 0]
        all_steps, _ = self.balance_networks(graphs, [INITIAL_STATE], self.max_steps)
        steps = all_steps[..., 0]
        energy = steps.astype(np.float64)
        records = {"solves": (steps == self.max_steps).astype(np.int32), **record_networks(graphs)}
        return LifeResults(energy, np.zeros_like(energy), None, records)


@jit_entry_point
def balance(
    graphs: Any, starts: Any, sensed: Any, loops: bool, max_steps: int, slope: Any,
    units: Any, ordered_links: Any, workspace: Any, recent_unrest: Any, steps: Any, unrest: Any,
) -> None:  # fmt: skip
    """Balance the poles with all networks from all initial states.

    Parameters
    ----------
    graphs : array of shape (runs, agents, entries)
        Networks.
    starts : array of shape (starts, 6)
        Initial states.
    sensed : array of int
        Indices of the state that are sensed.
    loops : bool
        Whether networks may be recurrent.
    max_steps : int
        Maximum number of steps.
    slope : float32
        Slope of the sigmoid.
    units : array of shape (2, units)
        Scratch.
    ordered_links : array of shape (2, links, 3)
        Scratch.
    workspace : array of shape (7, 6)
        Scratch.
    recent_unrest : array of shape (N_UNREST_STEPS,)
        Scratch.
    steps : array of shape (runs, agents, starts)
        Output: the number of steps until the cart leaves its track or a pole falls.
    unrest : array of shape (runs, agents, starts)
        Output: the sum over the last `N_UNREST_STEPS` steps of |position| + |velocity| of the cart
        + |angle| + |angular velocity| of the long pole.
    """
    for run in range(graphs.shape[0]):
        for agent in range(graphs.shape[1]):
            links = order_links(
                graphs[run, agent], sensed.size, loops, ordered_links[0], ordered_links[1], units[1]
            )
            for start in range(starts.shape[0]):
                _init_trial(starts[start], loops, units, workspace[0], recent_unrest)
                steps[run, agent, start] = _balance_once(
                    ordered_links[1],
                    links,
                    sensed,
                    loops,
                    max_steps,
                    slope,
                    units,
                    workspace,
                    recent_unrest,
                )
                total = 0.0
                for step in range(N_UNREST_STEPS):
                    total += recent_unrest[step]
                unrest[run, agent, start] = total


@compiled
def _init_trial(
    initial_state: Any, loops: bool, units: Any, state: Any, recent_unrest: Any
) -> None:
    """Set the initial state and the initial values of nodes.

    A node without links has the value 1/2. In recurrent networks, all initial values are 0.
    """
    for entry in range(STATE_SIZE):
        state[entry] = initial_state[entry]
    for row in range(units.shape[1]):
        units[0, row] = units[1, row] = np.float32(0) if loops else np.float32(0.5)
    for step in range(N_UNREST_STEPS):
        recent_unrest[step] = 0.0


@compiled
def _balance_once(
    ordered_links: Any,
    links: int,
    sensed: Any,
    loops: bool,
    max_steps: int,
    slope: Any,
    units: Any,
    workspace: Any,
    recent_unrest: Any,
) -> int:
    """Return the number of steps until the cart leaves its track or a pole falls."""
    state = workspace[0]
    step = 0
    sources = units[1 if loops else 0]
    values = units[0]
    while step < max_steps and is_balanced(state):
        output = activate_once(ordered_links, links, slope, sensed, state, sources, values)
        applied_force = MAX_FORCE * (2.0 * np.float64(output) - 1.0)
        if loops:
            for row in range(values.size):
                sources[row] = values[row]
        move(state, applied_force, TIME_STEP, HINGE_FRICTION, workspace)
        move(state, applied_force, TIME_STEP, HINGE_FRICTION, workspace)
        if is_balanced(state):
            recent_unrest[step % N_UNREST_STEPS] = (abs(state[0]) + abs(state[1])) + (
                abs(state[2]) + abs(state[3])
            )
            step += 1
    return step


@compiled
def order_links(
    graph: Any, inputs: int, loops: bool, unordered_links: Any, ordered_links: Any, is_ordered: Any
) -> int:
    """Order the enabled links by their evaluation, and return their number.

    Without loops, a link is after all links to its source. Links to the same node are adjacent, in
    the order of the genome.

    Parameters
    ----------
    graph : array of shape (entries,)
        The network.
    inputs : int
        Number of inputs without the bias.
    loops : bool
        Whether networks may be recurrent.
    unordered_links : array of shape (links, 3)
        Scratch.
    ordered_links : array of shape (links, 3)
        Output: source row, target row and weight of each link.
    is_ordered : array of shape (rows,)
        Scratch: 1 for inputs and for nodes whose links are ordered, else 0.
    """
    n_links = list_links(graph, inputs, 1, is_ordered.size, unordered_links)
    n_ordered = 0
    has_changed = True
    for row in range(is_ordered.size):
        is_ordered[row] = 1.0 if row < inputs else 0.0
    while has_changed:
        has_changed = False
        for row in range(inputs, is_ordered.size):
            if is_ordered[row] == 0.0 and (
                loops or _has_all_inputs(unordered_links, n_links, row, is_ordered)
            ):
                is_ordered[row] = 1.0
                has_changed = True
                for link in range(n_links):
                    if unordered_links[link, 1] == row:
                        for column in range(3):
                            ordered_links[n_ordered, column] = unordered_links[link, column]
                        n_ordered += 1
    return n_ordered


@compiled
def _has_all_inputs(unordered_links: Any, n_links: int, row: int, is_ordered: Any) -> bool:
    """Return whether the links to all source nodes of a node are ordered."""
    all_ordered = True
    for link in range(n_links):
        if unordered_links[link, 1] == row and unordered_links[link, 0] >= 0.0:
            all_ordered = all_ordered and is_ordered[int(unordered_links[link, 0])] > 0.0
    return all_ordered


@compiled
def activate_once(
    ordered_links: Any, links: int, slope: Any, sensed: Any, state: Any, sources: Any, values: Any
) -> Any:
    """Update the values of all nodes with links, and return the output, in (0, 1).

    Links read their inputs from `sources` [row]. In feed-forward networks, `sources` is `values`.
    In recurrent networks, `sources` has the values of the previous step and the current inputs. The
    row of the bias is -1.
    """
    for row in range(sensed.size):
        sources[row] = values[row] = np.float32(state[sensed[row]] / INPUT_SCALES[sensed[row]])
    link = 0
    while link < links:
        target = int(ordered_links[link, 1])
        total = np.float32(0)
        while link < links and int(ordered_links[link, 1]) == target:
            source = int(ordered_links[link, 0])
            total += ordered_links[link, 2] * (np.float32(1) if source < 0 else sources[source])
            link += 1
        values[target] = sigmoid(slope * total)
    return values[values.size - 1]
