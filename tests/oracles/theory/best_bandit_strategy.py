"""Mean payoff of the best of all strategies for a bandit, by dynamic programming.

References
----------
R. Bellman, "A problem in the sequential design of experiments", Sankhya 16 (1956).
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.signal import fftconvolve
from scipy.stats import norm

from baldwinlab.analysis.theory.choices import MEAN_PAYOFF, Bandit

# Grid of posterior means: half of the width, in prior standard deviations, and number of points.
GRID_WIDTH: Final = 8.0
GRID_SIZE: Final = 2001


def compute_optimal_payoff(bandit: Bandit) -> float:
    """Return the mean payoff of the best of all strategies, by dynamic programming.

    An agent that pulls arm 1 learns nothing, so it never returns to arm 2. The best strategy
    therefore pulls arm 2 until the posterior mean x is too low. After n pulls of arm 2, the value
    is F_n(x) = max(0, x + E F_(n+1)(x')), where x' is normal with the mean x. The variance of x' is
    the decrease of the posterior variance 1 / (1 / u^2 + n / s^2).
    """
    width = GRID_WIDTH * bandit.uncertainty
    means = np.linspace(MEAN_PAYOFF - width, MEAN_PAYOFF + width, GRID_SIZE)
    spacing = means[1] - means[0]
    pulls_done = np.arange(bandit.pulls + 1)
    variances = 1 / (1 / bandit.uncertainty**2 + pulls_done / bandit.noise**2)
    steps = np.sqrt(variances[:-1] - variances[1:])
    # All differences of two grid points.
    differences = spacing * np.arange(1 - GRID_SIZE, GRID_SIZE)
    values = np.zeros(GRID_SIZE)
    for n in reversed(range(bandit.pulls)):
        # The values are a sum of hinges max(0, x - g) at the grid points g. To the left of the
        # grid, the values are 0. To the right, the values continue with the last slope.
        slopes = np.diff(values, prepend=0.0, append=2 * values[-1] - values[-2]) / spacing
        hinges = np.diff(slopes)
        # The mean of a hinge has a formula if x' is normal.
        smallest_step = np.finfo(np.float64).tiny
        d = differences / max(steps[n], smallest_step)
        mean_hinge = differences * norm.cdf(d) + steps[n] * norm.pdf(d)
        next_values = fftconvolve(mean_hinge, hinges, mode="valid")
        values = np.maximum(0.0, means + next_values)
    return float(np.interp(MEAN_PAYOFF, means, values))
