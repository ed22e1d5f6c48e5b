"""The variation `few-mutations`, which mutates a fixed number of weights."""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.parts import Field, Mating, Variation


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
    reads = ("mutation_size",)

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                child[module, weight] = (
                    fitter[module, weight] if mating.gate < 0.5 else second[module, weight]
                )
        for mutation in range(min(part.mutations, mating.draws.shape[0])):
            # A position in the list of the weights of all modules.
            position = int(mating.draws[mutation, 1] * child.size)
            module = position // child.shape[1]
            weight = position % child.shape[1]
            change = (2.0 * mating.draws[mutation, 2] - 1.0) * part.mutation_size
            child[module, weight] += np.float32(change)
