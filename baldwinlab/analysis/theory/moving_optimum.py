"""Laws of a normal trait that follows a moving optimum, with a learned share of the distance.

Fitness is exp(-((1 - a)^2 + c a^2) d^2 / (2 width^2)) at the distance d from the optimum, where a
is the learned share of the distance, and c is the cost of learning. This is a normal function of d
with the squared width V_L of `selection_variance`. Selection moves the mean of a normal trait by
the fraction v / (v + V_L) of the distance from the mean to the optimum, and changes the variance v
to v V_L / (v + V_L). Both are exact for a normal distribution in an infinite population.

References
----------
.. [1] R. Lande, "Natural selection and random genetic drift in phenotypic evolution", Evolution 30
   (1976): the response of a normal trait.
.. [2] R. W. Anderson, "Learning and evolution: a quantitative genetics approach", Journal of
   Theoretical Biology 175 (1995): learning as a larger width.
.. [3] M. G. Bulmer, "The effect of selection on genetic variability", The American Naturalist 105
   (1971): the infinitesimal model with selection.
.. [4] M. Turelli, "Heritable genetic variation via mutation-selection balance", Theoretical
   Population Biology 25 (1984): the house-of-cards approximation.
"""

from __future__ import annotations

from math import inf, sqrt


def selection_variance(width: float, learned_share: float = 0.0, cost: float = 0.0) -> float:
    """Return the squared width V_L of fitness as a function of the distance at birth.

    Learning widens fitness: V_L = width^2 / ((1 - a)^2 + c a^2).

    Parameters
    ----------
    width : float
        Width of fitness as a function of the distance at death.
    learned_share : float
        Share a of the distance that learning removes, in [0, 1].
    cost : float
        Cost c of the squared learned distance.

    Returns
    -------
    float
        V_L. Infinite if learning removes the entire distance without a cost.
    """
    weight = (1 - learned_share) ** 2 + cost * learned_share**2
    return width * width / weight if weight > 0 else inf


def steady_mismatch(
    speed: float, learned_share: float, width: float, variance: float, cost: float = 0.0
) -> float:
    """Return the distance to the optimum after learning, in the steady state.

    In the steady state, selection moves the mean by k per generation, like the optimum. The mean at
    birth is then at the distance k (v + V_L) / v. Learning removes the share a, so without a cost
    the remaining distance is M = k ((1 - a) + width^2 / ((1 - a) v)).

    Parameters
    ----------
    speed : float
        Distance k that the optimum moves per generation.
    learned_share, width : float
        Arguments of `selection_variance`.
    variance : float
        Genetic variance v at birth.
    cost : float
        Argument of `selection_variance`.

    Returns
    -------
    float
        Mean remaining distance M. Infinite without selection on the trait (a = 1 and c = 0).
    """
    width_squared = selection_variance(width, learned_share, cost)
    if width_squared == inf:
        return inf
    return (1 - learned_share) * speed * (variance + width_squared) / variance


def variance_of_segregation(segregation_variance: float, width_squared: float) -> float:
    """Return the variance in the infinitesimal model: learning hardly changes this variance.

    A child is the mean of two parents plus noise: v = v V_L / (2 (v + V_L)) + V_S. The variance
    is about 2 V_S if selection is weak. The mismatch then increases with 1 / (1 - a).

    Parameters
    ----------
    segregation_variance : float
        Variance V_S of the noise.
    width_squared : float
        V_L, from `selection_variance`.

    Returns
    -------
    float
        Genetic variance v at birth.
    """
    # The positive root of 2 v^2 + (V_L - 2 V_S) v - 2 V_S V_L = 0.
    linear = width_squared - 2 * segregation_variance
    return (sqrt(linear**2 + 16 * segregation_variance * width_squared) - linear) / 4


def variance_of_mutations(mutation_variance: float, width_squared: float) -> float:
    """Return the variance if each birth mutates: learning does not change the mismatch.

    A child is one parent plus normal noise: v = v V_L / (v + V_L) + V_M. The variance is about
    sqrt(V_M V_L) if mutations are small. The mismatch is then k width / sqrt(V_M) for each a.

    Parameters
    ----------
    mutation_variance : float
        Variance V_M of a mutation.
    width_squared : float
        V_L, from `selection_variance`.

    Returns
    -------
    float
        Genetic variance v at birth.
    """
    product = mutation_variance * width_squared
    return (mutation_variance + sqrt(mutation_variance**2 + 4 * product)) / 2
