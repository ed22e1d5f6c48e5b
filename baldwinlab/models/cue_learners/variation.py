"""Crossover of units and links, and mutation of their genes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.evolution.variation_operators import cross_at_point, draw_cut, is_from_fitter
from baldwinlab.models.cue_learners.genes import draw_allele
from baldwinlab.models.cue_learners.model import CueLearners
from baldwinlab.parts import Variation


class OnePointOfUnits(Variation, name="one-point-of-units"):
    """One-point crossover of units and links; then each gene can be drawn anew.

    Only for the model `cue-learners`.

    References
    ----------
    Todd and Miller 1991.
    """

    settings: ClassVar[tuple[str, ...]] = ("mutation_rate",)
    derived: ClassVar[Mapping[str, Any]] = {
        "rate": lambda part, experiment: float(experiment.evolution.mutation_rate),
        "units": lambda part, experiment: int(experiment.model_part.units),
    }

    def check(self, experiment: Any) -> None:
        if experiment.model != CueLearners.name:
            raise ValueError(
                f"evolution.variation = {self.name!r} is only for the model {CueLearners.name!r}"
            )

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        cut = draw_cut(gate, child.shape[1])
        for gene in range(child.shape[1]):
            parent = fitter if is_from_fitter(gene, cut, draws[0, 0]) else second
            child[0, gene] = parent[0, gene]
            if draws[gene, 1] < part.rate:
                child[0, gene] = draw_allele(gene, part.units, draws[gene, 2])

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        child = cross_at_point(fitter[0], second[0], gate, draws[0][0])
        n_kind_genes = part.units
        n_strength_genes = part.units**2
        for gene, draw in enumerate(draws):
            if draw[1] < part.rate:
                if gene < n_kind_genes:
                    child[gene] = int(6 * draw[2])
                elif gene < n_kind_genes + n_strength_genes:
                    child[gene] = int(5 * draw[2]) / 2 - 1
                else:
                    child[gene] = int(2 * draw[2])
        return [child]
