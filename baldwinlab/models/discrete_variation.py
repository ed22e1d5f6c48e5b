"""Variation operators of discrete genes: bits, the alleles 0, 1 and ?, and four-bit weights."""

from __future__ import annotations

from typing import Any, Final, Literal

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import HALF, ONE, ZERO
from baldwinlab.evolution.variation_operators import draw_cut, is_from_fitter
from baldwinlab.models.kit import UNSET_ALLELE
from baldwinlab.parts import Field, Mating, Variation


class DiscreteVariation(Variation):
    """Base class of operators that mutate each gene with the mutation rate."""

    reads = ("mutation_rate",)


class BitFlips(DiscreteVariation, name="bit-flips"):
    """Copy of one parent, drawn at random; each bit can flip.

    References
    ----------
    Mayley 1996.
    """

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        n_modules = child.shape[0]
        n_bits = child.shape[1]
        for module in range(n_modules):
            for bit in range(n_bits):
                inherited = fitter[module, bit] if mating.gate < 0.5 else second[module, bit]
                flips = mating.draws[module * n_bits + bit, 1] < part.mutation_rate
                child[module, bit] = np.float32(1) - inherited if flips else inherited


class OnePointOfBits(DiscreteVariation, name="one-point-bits"):
    """One-point crossover of bits; then each bit can flip.

    References
    ----------
    Floreano and Urzelai 2000.
    """

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        n_modules = child.shape[0]
        module_size = child.shape[1]
        # The cut is an index in the list of the genes of all modules.
        cut = draw_cut(mating.gate, child.size)
        for module in range(n_modules):
            for bit in range(module_size):
                gene = module * module_size + bit
                parent = fitter if is_from_fitter(gene, cut, mating.draws[0, 0]) else second
                inherited = parent[module, bit]
                flips = mating.draws[gene, 1] < part.mutation_rate
                child[module, bit] = ONE - inherited if flips else inherited


class OnePointOfAlleles(DiscreteVariation, name="one-point-alleles"):
    """One-point crossover of the alleles 0, 1 and ?; then mutation to 0, 1 or ?.

    References
    ----------
    Hinton and Nowlan 1987.
    """

    mutation_law: Literal["uniform", "founders"] = Field(
        "uniform",
        description=(
            "Distribution of mutated alleles. uniform: 0, 1 and ? alike; founders: as"
            " among the founders."
        ),
    )
    derived = {
        # Three times the probability of 0, because `vary` compares it with a number in (0, 3).
        "three_zero_shares": lambda part, experiment: 3 * part.zero_share(experiment),
    }

    def zero_share(self, experiment: Any) -> float:
        """Return the probability that a mutated allele is 0. The probability of 1 is the same."""
        if self.mutation_law == "founders":
            return float((1 - experiment.model_part.initial_unset_share) / 2)
        return 1 / 3

    def check(self, experiment: Any) -> None:
        has_shares = experiment.model != "miniworld" and hasattr(
            experiment.model_part, "initial_unset_share"
        )
        if self.mutation_law == "founders" and not has_shares:
            raise ValueError(
                "evolution.one_point_alleles.mutation_law = 'founders' needs a model with a share "
                "of ? among the founders: "
                f"hinton-nowlan or moving-needle, and not {experiment.model!r}"
            )

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        # The cut is an index in the list of the genes of all modules.
        cut = draw_cut(mating.gate, child.size)
        for module in range(child.shape[0]):
            for locus in range(child.shape[1]):
                gene = module * child.shape[1] + locus
                parent = fitter if is_from_fitter(gene, cut, mating.draws[0, 0]) else second
                child[module, locus] = parent[module, locus]
                if mating.draws[gene, 1] < part.mutation_rate:
                    draw = 3.0 * mating.draws[gene, 2]
                    is_not_zero = draw >= part.three_zero_shares
                    is_one = draw >= 3.0 - part.three_zero_shares
                    # `n_halves` is 0, 1 or 2, so the allele is 0, ? (0.5) or 1.
                    n_halves = int(is_not_zero) + int(is_one)
                    child[module, locus] = np.float32(n_halves) * np.float32(UNSET_ALLELE)


BITS_PER_WEIGHT: Final = 4
# Number of possible values of a weight.
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
        # Rescale the random number `gate`, so that it is uniform in (0, 1) in both cases.
        position = (
            mating.gate / part.crossover_share
            if is_crossed
            else (mating.gate - part.crossover_share) / (1.0 - part.crossover_share)
        )
        # Index of a pair: a cut (half of the index) and the parent of the first weights (parity).
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
    """Return a weight after mutation. Bit i of the weight flips if `draws[i]` is below `rate`."""
    flipped_bits = 0
    for bit in range(BITS_PER_WEIGHT):
        flipped_bits += (1 << bit) if draws[bit] < rate else 0
    if flipped_bits == 0:
        return weight
    # The conversion to an integer rounds down, so 1/2 is added to get the nearest level.
    rounded = (weight + MAX_WEIGHT) / LEVEL_STEP + HALF
    level = int(min(max(rounded, ZERO), MAX_LEVEL)) ^ flipped_bits
    return np.float32(level) * LEVEL_STEP - MAX_WEIGHT
