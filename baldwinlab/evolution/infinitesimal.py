"""The variation operator `infinitesimal`: a child is the mean of its parents, plus normal noise.

The operator is the infinitesimal model of quantitative genetics. A trait has many loci with small
effects, so the children of two parents are normal around the mean of the parents, with a variance
that selection does not change.

References
----------
R. A. Fisher, "The correlation between relatives on the supposition of Mendelian inheritance",
Transactions of the Royal Society of Edinburgh 52 (1918).
M. G. Bulmer, "The effect of selection on genetic variability", The American Naturalist 105 (1971).
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.arithmetic import normal_quantile
from baldwinlab.parts import Mating, Variation


class Infinitesimal(Variation, name="infinitesimal"):
    """Mean of both parents for each weight, plus N(0, `mutation_size`) for each weight.

    References
    ----------
    Fisher 1918; Bulmer 1971.
    """

    reads: ClassVar[tuple[str, ...]] = ("mutation_size",)

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = mating.draws[module * child.shape[1] + weight, 2]
                mean = np.float32(0.5) * (fitter[module, weight] + second[module, weight])
                child[module, weight] = mean + np.float32(
                    normal_quantile(draw) * part.mutation_size
                )
