"""Law of the gain function: how learning changes the response to one generation of selection.

With the innate fitness f and the fitness with learning f_L, the gain is g = f_L / f. If parents
are selected in proportion to fitness, learning moves their mean trait by Cov_f(x, g) / E_f(g), with
moments weighted by f. This is exact for any distribution of the trait x. Chebyshev's inequality
gives its sign, which is that of the slope of ln g if this sign is the same for all agents.

References
----------
I. Paenke, T. J. Kawecki and B. Sendhoff, "The influence of learning on evolution: a mathematical
framework", Artificial Life 15 (2009).
"""

from __future__ import annotations

from math import nan

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]


def selection_gain(trait: Values, innate_fitness: Values, learned_fitness: Values) -> float:
    """Return the change of the mean trait of the parents by learning: Cov_f(x, g) / E_f(g).

    Parameters
    ----------
    trait : array of shape (agents,)
        Trait x.
    innate_fitness : array of shape (agents,)
        Fitness f without learning. Above 0.
    learned_fitness : array of shape (agents,)
        Fitness f_L with learning. At least one value is above 0.

    Returns
    -------
    float
        Mean of the parents with learning minus their mean without, in the unit of the trait.
    """
    weights = innate_fitness / innate_fitness.sum()
    gain = learned_fitness / innate_fitness
    mean_gain = weights @ gain
    deviation = trait - weights @ trait
    return float(weights @ (deviation * (gain - mean_gain)) / mean_gain)


def log_gain_slope_of_step(step: float, curvature: float) -> float:
    """Return the slope of ln g if learning adds a constant step to x.

    The slope of ln f(x + step) - ln f(x) is step times the curvature of ln f, if ln f is quadratic.

    Parameters
    ----------
    step : float
        Learned step.
    curvature : float
        Second derivative of ln f.

    Returns
    -------
    float
        Slope of ln g in x, the same for each x.
    """
    return step * curvature


def log_gain_slope_of_share(
    distance: Values | float, learned_share: float, width: float
) -> Values | float:
    """Return the slope of ln g if learning removes a share of the distance to a peak.

    With f = exp(-d^2 / (2 width^2)), ln g is (1 - (1 - a)^2) d^2 / (2 width^2). It decreases toward
    the peak, so such learning always slows evolution.

    Parameters
    ----------
    distance : float or array
        Distance d of x below the peak; negative above the peak.
    learned_share : float
        Share a of the distance that learning removes, in [0, 1].
    width : float
        Width of the peak.

    Returns
    -------
    float or array
        Slope of ln g in x.
    """
    return -(1 - (1 - learned_share) ** 2) * distance / (width * width)


def predict_effect(log_gain_slopes: Values) -> float:
    """Return the sign of the effect of learning on the mean trait of the parents.

    Parameters
    ----------
    log_gain_slopes : array
        Slopes of ln g between the lowest and the highest trait of the population.

    Returns
    -------
    float
        1 if no slope is below 0, -1 if none is above 0, and 0 if all are 0. NaN if the signs
        differ, because the law then does not determine the sign.
    """
    signs = set(np.sign(log_gain_slopes).ravel().tolist()) - {0.0}
    if len(signs) > 1:
        return nan
    return float(signs.pop()) if signs else 0.0
