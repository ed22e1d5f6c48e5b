"""Variation: what children have of their parents, and what is new.

Source: the paper, "Simulation 1: Evolution alone (EVO)"; docs/model.md for the alternatives (R5).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled
from baldwinlab.experiment import Evolution

OneGenome = npt.NDArray[np.float32]  # [module, weight]


class Mutation(NamedTuple):
    one_gate: bool  # for the child; else one for every weight
    rate: float  # probability that a gate opens
    size: float  # a mutation adds U(-size, size)


def mutation(evolution: Evolution) -> Mutation:
    return Mutation(evolution.mutation_gate == "child", float(evolution.mutation_rate), float(evolution.mutation_size))


@compiled
def vary(
    settings: Mutation, fitter: OneGenome, other: OneGenome, draws: npt.NDArray[np.float64], gate: float, child: OneGenome
) -> None:
    """Fill one `child`: every weight is copied from the fitter parent with probability 0.5, else from the other, and may mutate.

    `draws` is [module and weight, 4] in (0, 1), and `gate` one such number for the child.
    """
    for module in range(child.shape[0]):
        for weight in range(child.shape[1]):
            draw = module * child.shape[1] + weight
            inherited = fitter[module, weight] if draws[draw, 0] < 0.5 else other[module, weight]
            if (gate if settings.one_gate else draws[draw, 1]) < settings.rate:
                inherited += np.float32((2.0 * draws[draw, 2] - 1.0) * settings.size)
            child[module, weight] = inherited
