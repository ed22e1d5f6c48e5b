"""Variation: recombination of the genomes of two parents, and mutation.

References
----------
Le 2019, section "Simulation 1: Evolution alone (EVO)". docs/explanation/model.md lists the other
interpretations of this section (R5).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from baldwinlab.parts.variation import Variation

OneGenome = npt.NDArray[np.float32]  # [module, weight]
Draws = npt.NDArray[np.float64]  # [module and weight, 4]


class Crossover(Variation, name="crossover"):
    """Each weight from the fitter parent with probability 0.5, else from the other; then mutation.

    References
    ----------
    Le 2019.
    """

    derived: ClassVar[Mapping[str, Any]] = {
        "one_gate": lambda part, experiment: (
            experiment.evolution.mutation_gate == "child"
        ),  # else one for every weight
        "rate": lambda part, experiment: float(
            experiment.evolution.mutation_rate
        ),  # probability that a gate opens
        "size": lambda part, experiment: float(
            experiment.evolution.mutation_size
        ),  # a mutation adds U(-size, size)
    }

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                inherited = (
                    fitter[module, weight] if draws[draw, 0] < 0.5 else second[module, weight]
                )
                if (gate if part.one_gate else draws[draw, 1]) < part.rate:
                    inherited += np.float32((2.0 * draws[draw, 2] - 1.0) * part.size)
                child[module, weight] = inherited

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        draw = iter(draws)
        child: list[list[float]] = []
        for of_fitter, of_other in zip(fitter, second, strict=True):
            child.append([])
            for ours, theirs in zip(of_fitter, of_other, strict=True):
                coin, own_gate, size, _ = next(draw)
                opens = (gate if part.one_gate else own_gate) < part.rate
                child[-1].append(
                    (ours if coin < 0.5 else theirs) + opens * part.size * (2 * size - 1)
                )
        return child
