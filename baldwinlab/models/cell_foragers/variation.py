"""The variation `few-mutations`, which mutates a fixed number of weights."""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.parts import Field, Variation


class FewMutations(Variation, name="few-mutations"):
    """Copy of one parent, chosen at random; a fixed number of weights mutate.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    mutations: int = Field(
        5,
        ge=0,
        le=1000,
        description="Number of weights of a child that mutate, drawn with replacement.",
    )
    settings = ("mutation_size",)
    derived = {"size": lambda part, experiment: float(experiment.evolution.mutation_size)}

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                child[module, weight] = (
                    fitter[module, weight] if gate < 0.5 else second[module, weight]
                )
        for mutation in range(min(part.mutations, draws.shape[0])):
            # A position in the list of the weights of all modules.
            position = int(draws[mutation, 1] * child.size)
            module = position // child.shape[1]
            weight = position % child.shape[1]
            change = (2.0 * draws[mutation, 2] - 1.0) * part.size
            child[module, weight] += np.float32(change)
