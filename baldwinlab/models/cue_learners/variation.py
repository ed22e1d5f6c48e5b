"""Crossover of units and links, and mutation of their genes."""

from __future__ import annotations

from typing import Any

from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.evolution.variation_operators import draw_cut, is_from_fitter
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

    settings = ("mutation_rate",)
    derived = {
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
