"""The model of the exclusive or (XOR), the first task of NEAT, which needs a hidden node.

    baldwinlab reproduce stanley-miikkulainen-2002

A network has two inputs and a bias. The output must be above 1/2 if exactly one input is 1, and
below 1/2 otherwise. The questions of a lifetime are the four combinations of the two inputs.
Fitness is (4 - e)^2, where e is the sum of |answer - correct answer| over the four questions.

References
----------
Stanley and Miikkulainen 2002, section 4.1 (all numbers) and section 4.2. There, 100 runs with 150
networks take 32 generations and 4,755 networks (SD 2,553) on average. The solutions have 2.35
hidden nodes and 7.48 enabled links on average.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.jit import jit_entry_point
from baldwinlab.evolution.neat import oracle
from baldwinlab.evolution.neat.genome import (
    INFINITE_GENES,
    activate,
    count_entries,
    make_minimal_graphs,
    require_neat,
)
from baldwinlab.models.neat.measures import NETWORK_RECORDS, measure_solutions, record_networks
from baldwinlab.parts import FOUNDER, PER_AGENT_DIMS, Field, LifeResults, Measure, Model, Variable

QUESTIONS: Final = ((0, 0), (0, 1), (1, 0), (1, 1))
ANSWERS: Final = (0, 1, 1, 0)


class NeatXor(Model, name="neat-xor"):
    """Networks with evolving topology that compute the exclusive or."""

    max_links: int = Field(
        60, ge=3, le=1000, description="Maximum number of links in a genome (our choice)."
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
    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 150},
        "evolution": {"generations": 150, "selection": "species", "variation": "neat"},
        "record": {"genome_every": 10},
    }
    records: ClassVar[Mapping[str, Variable]] = {
        "right": Variable(
            PER_AGENT_DIMS, np.int32, "answers", "number of correct answers, of four"
        ),
        **NETWORK_RECORDS,
    }

    measures: ClassVar[Mapping[str, Measure]] = measure_solutions(
        lambda runs: runs["right"] == len(QUESTIONS)
    )

    def without_learning(self) -> NeatXor:
        return self

    def check(self, experiment: Any) -> None:
        require_neat(experiment, f"model = {self.name!r}")

    def n_weights(self) -> int:
        return count_entries(self.max_links)

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        # The bias is an input.
        inputs = len(QUESTIONS[0]) + 1
        draws = key.uniforms(FOUNDER, (agents, inputs))[:, :, 0]
        weights = (2 * draws - 1) * self.founder_weight_range
        return make_minimal_graphs(inputs, 1, self.max_links, weights)[:, None]

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        graphs = np.ascontiguousarray(genomes[:, :, 0])
        answers = poison.empty((*graphs.shape[:2], len(QUESTIONS)), np.float32)
        units = poison.empty(len(QUESTIONS[0]) + self.max_links + 1, np.float32)
        answer_questions(
            graphs, np.array(QUESTIONS, np.float32), np.float32(self.sigmoid_slope), units, answers
        )
        errors = np.abs(answers - np.array(ANSWERS, np.float32)).astype(np.float64)
        right = (errors < 0.5).sum(axis=-1, dtype=np.int32)
        # The parentheses fix the order of the additions, on which rounding depends.
        total_error = (errors[..., 0] + errors[..., 1]) + (errors[..., 2] + errors[..., 3])
        energy = (4 - total_error) ** 2
        return LifeResults(
            energy, np.zeros_like(energy), None, {"right": right, **record_networks(graphs)}
        )

    def oracle(self, graph: Any) -> float:
        """Return the fitness of one network [entry]."""
        answers = [
            oracle.activate(graph, self.sigmoid_slope, (*question, 1))[0] for question in QUESTIONS
        ]
        errors = [abs(answer - right) for answer, right in zip(answers, ANSWERS, strict=True)]
        return float((4 - sum(errors)) ** 2)


@jit_entry_point
def answer_questions(graphs: Any, questions: Any, steepness: Any, units: Any, answers: Any) -> None:
    """Fill `answers` [run, agent, question] with the outputs of all networks.

    `units` is scratch of the shape that `activate` needs.
    """
    for run in range(graphs.shape[0]):
        for agent in range(graphs.shape[1]):
            for question in range(questions.shape[0]):
                for number in range(questions.shape[1]):
                    units[number] = questions[question, number]
                activate(graphs[run, agent], questions.shape[1], 1, steepness, units)
                answers[run, agent, question] = units[units.size - 1]
