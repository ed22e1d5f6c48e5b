"""Crossover of units and links, and mutation of their genes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from baldwinlab.evolution.variation_operators import draw_cut, is_from_fitter
from baldwinlab.models.cue_learners.genes import draw_allele
from baldwinlab.models.cue_learners.model import CueLearners
from baldwinlab.parts import Mating, Variation


class OnePointOfUnits(Variation, name="one-point-of-units"):
    """One-point crossover of units and links; then each gene can be drawn anew.

    Only for the model `cue-learners`.

    References
    ----------
    Todd and Miller 1991.
    """

    reads: ClassVar[tuple[str, ...]] = ("mutation_rate",)
    derived: ClassVar[Mapping[str, Any]] = {
        "units": lambda part, experiment: int(experiment.model_part.units),
    }

    def check(self, experiment: Any) -> None:
        if experiment.model != CueLearners.name:
            raise ValueError(
                f"evolution.variation = {self.name!r} is only for the model {CueLearners.name!r}"
            )

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        child = mating.child
        cut = draw_cut(mating.gate, child.shape[1])
        for gene in range(child.shape[1]):
            takes_fitter = is_from_fitter(gene, cut, mating.draws[0, 0])
            parent = mating.fitter if takes_fitter else mating.second
            child[0, gene] = parent[0, gene]
            if mating.draws[gene, 1] < part.mutation_rate:
                child[0, gene] = draw_allele(gene, part.units, mating.draws[gene, 2])
