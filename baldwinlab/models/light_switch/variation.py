"""One-point crossover and mutation of bits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.evolution.variation_operators import (
    cross_at_point,
    draw_cut,
    flatten,
    is_from_fitter,
    split_modules,
)
from baldwinlab.models.light_switch.lifetimes import ONE
from baldwinlab.parts import (
    Variation,
)


class OnePointOfBits(Variation, name="one-point-bits"):
    """One-point crossover of bits; then each bit can flip.

    References
    ----------
    Floreano and Urzelai 2000.
    """

    settings: ClassVar[tuple[str, ...]] = ("mutation_rate",)
    derived: ClassVar[Mapping[str, Any]] = {
        "rate": lambda part, experiment: float(experiment.evolution.mutation_rate)
    }

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

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        inherited = cross_at_point(flatten(fitter), flatten(second), gate, draws[0][0])
        child = [
            1 - bit if draw[1] < part.rate else bit
            for bit, draw in zip(inherited, draws, strict=True)
        ]
        return split_modules(child, len(fitter[0]))
