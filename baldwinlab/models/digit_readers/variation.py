"""Crossover and mutation of four-bit weights."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.evolution.variation_operators import flatten, split_modules
from baldwinlab.parts import (
    Field,
    Variation,
)

# Number of levels of a weight, which has four bits.
N_LEVELS: Final = 16
MAX_WEIGHT: Final = np.float32(2)
# Difference between two successive levels.
LEVEL_STEP: Final = np.float32(4 / 15)
MAX_LEVEL: Final = np.float32(N_LEVELS - 1)
HALF = np.float32(0.5)
ZERO = np.float32(0)


class FourBitWeights(Variation, name="four-bit-weights"):
    """Copy of one parent, or one-point crossover, of four-bit weights; each bit can flip.

    A weight is -2 + k * 4/15 for k from 0 to 15.

    References
    ----------
    Keesing and Stork 1991.
    """

    crossover_share: float = Field(
        0.5, ge=0, le=1, description="Share of the children with weights of both parents."
    )
    settings: ClassVar[tuple[str, ...]] = ("mutation_rate",)
    derived: ClassVar[Mapping[str, Any]] = {
        "rate": lambda part, experiment: float(experiment.evolution.mutation_rate)
    }

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        n_weights = child.size
        is_crossed = gate < part.crossover_share
        # A uniform number in (0, 1), with or without crossover.
        position = (
            gate / part.crossover_share
            if is_crossed
            else (gate - part.crossover_share) / (1.0 - part.crossover_share)
        )
        # `index` numbers the combinations of a cut and of the parent of the first weights.
        index = int(position * 2 * (n_weights - 1))
        cut = 1 + index // 2 if is_crossed else n_weights
        starts_with_fitter = index % 2 == 0
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                uses_fitter = (draw < cut) == starts_with_fitter
                inherited = fitter[module, weight] if uses_fitter else second[module, weight]
                child[module, weight] = _flip_bits(inherited, draws[draw], part.rate)

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        parents = flatten(fitter), flatten(second)
        n_weights = len(parents[0])
        if gate < part.crossover_share:
            index = int(gate / part.crossover_share * 2 * (n_weights - 1))
            cut = 1 + index // 2
        else:
            share = (gate - part.crossover_share) / (1 - part.crossover_share)
            index = int(share * 2 * (n_weights - 1))
            cut = n_weights
        child = [*parents[index % 2][:cut], *parents[1 - index % 2][cut:]]
        for weight, draw in enumerate(draws):
            flipped = sum(2**bit for bit in range(4) if draw[bit] < part.rate)
            if flipped:
                level = int(min(max((child[weight] + 2) * 15 / 4 + 0.5, 0), 15)) ^ flipped
                child[weight] = level * 4 / 15 - 2
        return split_modules(child, len(fitter[0]))


@compiled
def _flip_bits(weight: Any, draws: Any, rate: float) -> Any:
    """Return a weight after the mutation of its four bits, each with one of four `draws`."""
    flipped = 0
    for bit in range(4):
        flipped += (1 << bit) if draws[bit] < rate else 0
    if flipped == 0:
        return weight
    level = int(min(max((weight + MAX_WEIGHT) / LEVEL_STEP + HALF, ZERO), MAX_LEVEL)) ^ flipped
    return np.float32(level) * LEVEL_STEP - MAX_WEIGHT
