"""The model of the exclusive or (XOR), the first task of NEAT, which needs a hidden node.

    baldwinlab reproduce stanley-miikkulainen-2002

A network has two inputs and a bias. The output must be above 1/2 if exactly one input is 1, and
below 1/2 otherwise. The questions of a lifetime are the four combinations of the two inputs.
Fitness is (4 - e)^2, where e is the sum of |answer - correct answer| over the four questions.

References
----------
Stanley and Miikkulainen 2002. Settings: section 4.1. Results: section 4.2, as means of 100 runs of
populations of 150. A solution takes 32 generations and 4,755 networks (SD 2,553). It has 2.35
hidden nodes and 7.48 enabled links.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine import poison
from baldwinlab.engine.jit import jit_entry_point
from baldwinlab.evolution.neat.genome import SIGMOID_SLOPE, activate
from baldwinlab.models import kit
from baldwinlab.models.neat.network_model import (
    FOUNDER_WEIGHT_RANGE,
    N_OUTPUTS,
    NETWORK_RECORDS,
    NetworkModel,
    measure_solutions,
    record_networks,
)
from baldwinlab.parts import Field, LifeResults, Variable

QUESTIONS: Final = ((0, 0), (0, 1), (1, 0), (1, 1))
CORRECT_ANSWERS: Final = (0, 1, 1, 0)


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
