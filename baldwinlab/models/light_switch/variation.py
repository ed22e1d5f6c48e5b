"""One-point crossover and mutation of bits."""

from __future__ import annotations

from typing import Any, ClassVar

from baldwinlab.engine.simd import ONE
from baldwinlab.evolution.variation_operators import (
    draw_cut,
    is_from_fitter,
)
from baldwinlab.parts import (
    Mating,
    Variation,
)


class OnePointOfBits(Variation, name="one-point-bits"):
    """One-point crossover of bits; then each bit can flip.

    References
    ----------
    Floreano and Urzelai 2000.
    """

    reads: ClassVar[tuple[str, ...]] = ("mutation_rate",)

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        n_modules = child.shape[0]
        module_size = child.shape[1]
        # The cut is a position in the list of the genes of all modules.
        cut = draw_cut(mating.gate, child.size)
        for module in range(n_modules):
            for bit in range(module_size):
                gene = module * module_size + bit
                parent = fitter if is_from_fitter(gene, cut, mating.draws[0, 0]) else second
                inherited = parent[module, bit]
                flips = mating.draws[gene, 1] < part.mutation_rate
                child[module, bit] = ONE - inherited if flips else inherited
