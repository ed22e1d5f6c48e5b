"""One-point crossover and mutation of bits."""

from __future__ import annotations

from typing import Any

from baldwinlab.engine.simd import ONE
from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.evolution.variation_operators import (
    draw_cut,
    is_from_fitter,
)
from baldwinlab.parts import (
    Variation,
)


class OnePointOfBits(Variation, name="one-point-bits"):
    """One-point crossover of bits; then each bit can flip.

    References
    ----------
    Floreano and Urzelai 2000.
    """

    settings = ("mutation_rate",)
    derived = {"rate": lambda part, experiment: float(experiment.evolution.mutation_rate)}

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        n_modules = child.shape[0]
        module_size = child.shape[1]
        # The cut is a position in the list of the genes of all modules.
        cut = draw_cut(gate, child.size)
        for module in range(n_modules):
            for bit in range(module_size):
                gene = module * module_size + bit
                parent = fitter if is_from_fitter(gene, cut, draws[0, 0]) else second
                inherited = parent[module, bit]
                flips = draws[gene, 1] < part.rate
                child[module, bit] = ONE - inherited if flips else inherited
