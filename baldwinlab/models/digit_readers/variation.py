"""Crossover and mutation of four-bit weights."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import HALF, ZERO
from baldwinlab.models.discrete_variation import DiscreteVariation
from baldwinlab.parts import Field, Mating

BITS_PER_WEIGHT: Final = 4
# Number of levels of a weight.
N_LEVELS: Final = 2**BITS_PER_WEIGHT
MAX_WEIGHT: Final = np.float32(2)
# Difference between two successive levels.
LEVEL_STEP: Final = np.float32(4 / 15)
MAX_LEVEL: Final = np.float32(N_LEVELS - 1)


class FourBitWeights(DiscreteVariation, name="four-bit-weights"):
    """Copy of one parent, or one-point crossover, of four-bit weights; each bit can flip.

    A weight is -2 + k * 4/15 for k from 0 to 15.

    References
    ----------
    Keesing and Stork 1991.
    """

    crossover_share: float = Field(
        0.5, ge=0, le=1, description="Share of the children with weights of both parents."
    )

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        n_modules = child.shape[0]
        module_size = child.shape[1]
        n_weights = child.size
        is_crossed = mating.gate < part.crossover_share
        # A uniform number in (0, 1), with or without crossover.
        position = (
            mating.gate / part.crossover_share
            if is_crossed
            else (mating.gate - part.crossover_share) / (1.0 - part.crossover_share)
        )
        # Number of a combination of a cut and of the parent of the first weights.
        combination = int(position * 2 * (n_weights - 1))
        cut = 1 + combination // 2 if is_crossed else n_weights
        starts_with_fitter = combination % 2 == 0
        for module in range(n_modules):
            for weight in range(module_size):
                gene = module * module_size + weight
                is_from_fitter = (gene < cut) == starts_with_fitter
                inherited = fitter[module, weight] if is_from_fitter else second[module, weight]
                child[module, weight] = _flip_bits(
                    inherited, mating.draws[gene], part.mutation_rate
                )


@compiled
def _flip_bits(weight: Any, draws: Any, rate: float) -> Any:
    """Return a weight after the mutation of its four bits, each with one of four `draws`."""
    flipped_bits = 0
    for bit in range(BITS_PER_WEIGHT):
        flipped_bits += (1 << bit) if draws[bit] < rate else 0
    if flipped_bits == 0:
        return weight
    # The addition of 1/2 rounds to the nearest level.
    rounded = (weight + MAX_WEIGHT) / LEVEL_STEP + HALF
    level = int(min(max(rounded, ZERO), MAX_LEVEL)) ^ flipped_bits
    return np.float32(level) * LEVEL_STEP - MAX_WEIGHT
