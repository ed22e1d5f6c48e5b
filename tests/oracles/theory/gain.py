"""Law of the gain function: how learning changes the response to one generation of selection.

With the innate fitness f and the fitness with learning f_L, the gain is g = f_L / f. If parents
are selected in proportion to fitness, learning moves their mean trait by Cov_f(x, g) / E_f(g), with
moments weighted by f. This is exact for any distribution of the trait x. If ln g increases with x
for all agents, this change is positive; if ln g decreases, it is negative (Chebyshev's inequality).

References
----------
I. Paenke, T. J. Kawecki and B. Sendhoff, "The influence of learning on evolution: a mathematical
framework", Artificial Life 15 (2009).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]


def selection_gain(trait: Values, innate_fitness: Values, learned_fitness: Values) -> float:
    """Return the change of the mean trait of the parents by learning: Cov_f(x, g) / E_f(g)."""
    weights = innate_fitness / innate_fitness.sum()
    gain = learned_fitness / innate_fitness
    mean_gain = weights @ gain
    deviation = trait - weights @ trait
    return float(weights @ (deviation * (gain - mean_gain)) / mean_gain)
