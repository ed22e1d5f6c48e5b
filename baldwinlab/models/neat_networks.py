"""Base class of all models in which the topology of networks evolves (NEAT), and the model of XOR.

    baldwinlab reproduce stanley-miikkulainen-2002

The first solution of a run is the agent with the smallest index among the agents that solve the
task in the earliest possible generation.

The exclusive or (XOR) is the first task of NEAT. Its solution needs a hidden node. A network has
two inputs and a bias. The output must be above 1/2 if exactly one input is 1, and below 1/2
otherwise. In a lifetime, a network answers four questions: the combinations of the two inputs.
Fitness is (4 - e)^2, where e is the sum of |answer - correct answer| over the four questions.

References
----------
Stanley and Miikkulainen 2002. Settings: section 4.1. Results: section 4.2, as means of 100 runs of
populations of 150. A solution takes 32 generations and 4,755 networks (SD 2,553). It has 2.35
hidden nodes and 7.48 enabled links.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.engine import poison
from baldwinlab.engine.jit import jit_entry_point
from baldwinlab.evolution.neat.genome import (
    ENABLED,
    GENE_SIZE,
    HEAD_SIZE,
    INFINITE_GENES,
    INNOVATION,
    SIGMOID_SLOPE,
    SPECIES,
    TARGET,
    activate,
    count_entries,
    make_minimal_graphs,
    require_neat,
)
from baldwinlab.models import kit
from baldwinlab.parts import Field, LifeResults, Measure, Model, Variable

NETWORK_RECORDS: Final[Mapping[str, Variable]] = {
    "hidden": Variable.integer("nodes", "hidden nodes"),
    "enabled": Variable.integer("links", "enabled links"),
    "species": Variable.integer("", "number of the species, in the order in which they arose"),
}

N_OUTPUTS: Final = 1
# Inputs of the four questions of the exclusive or, and the correct answers in the same order.
QUESTIONS: Final = ((0, 0), (0, 1), (1, 0), (1, 1))
CORRECT_ANSWERS: Final = (0, 1, 1, 0)
FOUNDER_WEIGHT_RANGE: Any = Field(
    1.0,
    ge=0,
    le=1000,
    description="Limit R of the founders' weights, drawn from U(-R, R) (our choice).",
)

# Function from runs to booleans [run, generation, agent]: whether the agent solves the task.
Solves = Callable[["xr.Dataset"], "xr.DataArray"]


class NetworkModel(Model):
    """Base class of the models in which the topology of networks with one output evolves."""

    if TYPE_CHECKING:
        # Each model declares these settings itself, in the order of the printed settings.
        max_links: int
        founder_weight_range: float

    has_graph_genomes = True
    infinite_genes = INFINITE_GENES
    # Number of inputs without the bias.
    n_inputs: ClassVar[int]

    def without_learning(self) -> Self:
        return self

    def check(self, experiment: Any) -> None:
        require_neat(experiment, f"model = {self.name!r}")

    def n_weights(self) -> int:
        return count_entries(self.max_links)

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        # A minimal network has a link from each input and from the bias to the output.
        n_sources = self.n_inputs + 1
        draws = kit.draw_founder_numbers(key, agents, n_sources)[:, 0]
        weights = (2 * draws - 1) * self.founder_weight_range
        graphs = make_minimal_graphs(n_sources, N_OUTPUTS, self.max_links, weights)
        # [agent, 1, entry], because a genome has one module.
        return graphs[:, None]


def record_networks(graphs: kit.Genomes) -> Mapping[str, npt.NDArray[Any]]:
    """Return the records of `NETWORK_RECORDS` for genomes [run, agent, entry]."""
    # [run, agent, link, entry].
    genes = graphs[:, :, HEAD_SIZE:].reshape(*graphs.shape[:2], -1, GENE_SIZE)
    exists = genes[..., INNOVATION] > 0
    return {
        # Each hidden node has one gene with INNOVATION = TARGET, see `defines_node`.
        "hidden": (exists & (genes[..., INNOVATION] == genes[..., TARGET])).sum(axis=-1),
        "enabled": (exists & (genes[..., ENABLED] > 0)).sum(axis=-1),
        "species": graphs[:, :, SPECIES],
    }


def measure_solutions(
    solves: Solves, recorded: Mapping[str, str] = MappingProxyType({})
) -> Mapping[str, Measure]:
    """Return the measures of a model whose agents are networks, by name.

    `recorded`: meanings of further records of the first solution, by name. Without a solution, all
    measures except `solved` are NaN.
    """

    def is_solved(runs: xr.Dataset) -> xr.DataArray:
        return solves(runs).any(("generation", "agent")) * 1.0

    def measure_first_solution(
        meaning: str,
        quantity: Callable[[xr.Dataset, npt.NDArray[np.intp]], npt.NDArray[Any]],
    ) -> Measure:
        """Return a measure. `quantity` gets the runs and the index of the first solution [run]."""

        def measure(runs: xr.Dataset) -> xr.DataArray:
            # `argmax` returns the index of the first True.
            positions = _order_by_evaluation(solves(runs)).argmax(axis=1)
            values = xr.DataArray(quantity(runs, positions), {"run": runs["run"]}, "run")
            return values.where(is_solved(runs) == 1)

        return Measure(meaning, measure)

    def measure_record(name: str, meaning: str) -> Measure:
        return measure_first_solution(
            meaning,
            lambda runs, positions: _order_by_evaluation(runs[name])[
                np.arange(len(positions)), positions
            ],
        )

    return {
        "solved": Measure("1 if any network solves the task, else 0", is_solved),
        "generations": measure_first_solution(
            "generations to the first solution",
            lambda runs, positions: positions // runs.sizes["agent"] + 1,
        ),
        "evaluations": measure_first_solution(
            "networks evaluated to the first solution", lambda runs, positions: positions + 1
        ),
        "hidden": measure_record("hidden", "hidden nodes of the first solution"),
        "enabled": measure_record("enabled", "enabled links of the first solution"),
        **{name: measure_record(name, meaning) for name, meaning in recorded.items()},
    }


def _order_by_evaluation(record: xr.DataArray) -> npt.NDArray[Any]:
    """Return a record as [run, network], ordered by generation, then by agent."""
    return record.transpose("run", "generation", "agent").values.reshape(record.sizes["run"], -1)


class NeatXor(NetworkModel, name="neat-xor"):
    """Networks with evolving topology that compute the exclusive or."""

    max_links: int = Field(
        60, ge=3, le=1000, description="Maximum number of links in a genome (our choice)."
    )
    sigmoid_slope: float = SIGMOID_SLOPE
    founder_weight_range: float = FOUNDER_WEIGHT_RANGE

    n_inputs: ClassVar[int] = len(QUESTIONS[0])
    defaults = {
        "population": {"size": 150},
        "evolution": {"generations": 150, "selection": "species", "variation": "neat"},
        "record": {"genome_every": 10},
    }
    records = {
        "right": Variable.integer("answers", "number of correct answers, of four"),
        **NETWORK_RECORDS,
    }

    measures = measure_solutions(lambda runs: runs["right"] == len(QUESTIONS))

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        graphs = np.ascontiguousarray(genomes[:, :, 0])
        answers = poison.empty((*graphs.shape[:2], len(QUESTIONS)), np.float32)
        # A hidden node needs a link, so there are at most `max_links` hidden nodes.
        values = poison.empty(self.n_inputs + self.max_links + N_OUTPUTS, np.float32)
        questions = np.array(QUESTIONS, np.float32)
        answer_questions(graphs, questions, np.float32(self.sigmoid_slope), values, answers)
        errors = np.abs(answers - np.array(CORRECT_ANSWERS, np.float32)).astype(np.float64)
        n_right = (errors < 0.5).sum(axis=-1, dtype=np.int32)
        # The parentheses fix the order of the additions, on which rounding depends.
        total_error = (errors[..., 0] + errors[..., 1]) + (errors[..., 2] + errors[..., 3])
        fitness = (len(QUESTIONS) - total_error) ** 2
        records = {"right": n_right, **record_networks(graphs)}
        return self.make_results(fitness, records)


@jit_entry_point
def answer_questions(
    graphs: Any, questions: Any, sigmoid_slope: Any, values: Any, answers: Any
) -> None:
    """Fill `answers` [run, agent, question] with the outputs of all networks.

    `values` [node] is scratch: inputs, hidden nodes, and the output in the last entry.
    """
    n_inputs = questions.shape[1]
    for run in range(graphs.shape[0]):
        for agent in range(graphs.shape[1]):
            for question in range(questions.shape[0]):
                for input_index in range(n_inputs):
                    values[input_index] = questions[question, input_index]
                activate(graphs[run, agent], n_inputs, N_OUTPUTS, sigmoid_slope, values)
                answers[run, agent, question] = values[values.size - 1]
