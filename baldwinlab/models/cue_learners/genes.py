"""Alleles of the genes of units and links, their crossover and their mutation."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import HALF, ONE
from baldwinlab.evolution.variation_operators import draw_cut, is_from_fitter
from baldwinlab.models.discrete_variation import DiscreteVariation
from baldwinlab.parts import Mating

# Number of kinds of units.
N_KINDS: Final = 6
# Number of strengths of a link: -1, -1/2, 0, 1/2 and 1.
N_STRENGTHS: Final = 5


@compiled
def draw_allele(gene: int, n_units: int, draw: float) -> Any:
    """Return the allele of a gene for a uniform number `draw`.

    The genes are the kinds of the units (0 to 5), then the strengths of the links (-1 to 1), then
    the Hebbian flags of the links (0 or 1).
    """
    if gene < n_units:
        return np.float32(int(N_KINDS * draw))
    if gene < n_units + n_units * n_units:
        return np.float32(int(N_STRENGTHS * draw)) * HALF - ONE
    return np.float32(int(2 * draw))


class OnePointOfUnits(DiscreteVariation, name="one-point-of-units"):
    """One-point crossover of units and links; then each gene can be drawn anew.

    Only for the model `cue-learners`.

    References
    ----------
    Todd and Miller 1991.
    """

    derived = {
        "units": lambda part, experiment: int(experiment.model_part.units),
    }

    def check(self, experiment: Any) -> None:
        if experiment.model != "cue-learners":
            raise ValueError(
                f"evolution.variation = {self.name!r} is only for the model 'cue-learners'"
            )

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        cut = draw_cut(mating.gate, child.shape[1])
        for gene in range(child.shape[1]):
            parent = fitter if is_from_fitter(gene, cut, mating.draws[0, 0]) else second
            child[0, gene] = parent[0, gene]
            if mating.draws[gene, 1] < part.mutation_rate:
                child[0, gene] = draw_allele(gene, part.units, mating.draws[gene, 2])
