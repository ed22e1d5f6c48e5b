"""The variation operator `crossover`: recombination of two parents, then mutation.

References
----------
Le 2019, section "Simulation 1: Evolution alone (EVO)". docs/explanation/model.md lists the other
interpretations of this section (R5).
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.parts.variation import Mating, Variation


class Crossover(Variation, name="crossover"):
    """Each weight from the fitter or the second parent with equal probability; then mutation.

    References
    ----------
    Le 2019.
    """

    reads: ClassVar[tuple[str, ...]] = ("mutation_gate", "mutation_rate", "mutation_size")

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                takes_fitter = mating.draws[draw, 0] < 0.5
                inherited = fitter[module, weight] if takes_fitter else second[module, weight]
                child[module, weight] = mutate_uniformly(part, mating, inherited, draw)


@compiled
def mutate_uniformly(part: Any, mating: Mating, inherited: Any, draw: int) -> Any:
    """Return a weight after a possible mutation, which adds U(-size, size)."""
    gate = mating.gate if part.mutation_gate else mating.draws[draw, 1]
    if gate < part.mutation_rate:
        inherited += np.float32((2.0 * mating.draws[draw, 2] - 1.0) * part.mutation_size)
    return inherited
