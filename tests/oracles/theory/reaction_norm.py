"""Laws of a linear reaction norm after a sudden change of the environment.

An individual with the intercept a and the slope b develops the phenotype z = a + b e from a cue e.
Selection favors the optimum B times a later environment. The mean environment changes from 0 to
`jump`; around it, cue and later environment vary with the correlation `predictability`.

References
----------
.. [1] R. Lande, "Adaptation to an extraordinary environment by evolution of phenotypic plasticity
   and genetic assimilation", Journal of Evolutionary Biology 22 (2009).
.. [2] M. G. Bulmer, "The effect of selection on genetic variability", The American Naturalist 105
   (1971).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]


class Setting(NamedTuple):
    """Environment, selection and genetic variance.

    Attributes
    ----------
    optimum_slope : float
        Slope B of the optimum over the environment.
    peak_variance : float
        Squared width V of the fitness exp(-(z - optimum)^2 / (2 V) - cost b^2 / 2).
    intercept_variance, slope_variance : float
        Genetic variances of a and b.
    jump : float
        Mean environment after the change.
    noise_variance : float
        Variance of the environment around its mean.
    predictability : float
        Correlation of the cue with the environment of selection.
    cost : float
        Cost of plasticity.
    """

    optimum_slope: float
    peak_variance: float
    intercept_variance: float
    slope_variance: float
    jump: float
    noise_variance: float
    predictability: float
    cost: float = 0.0


class Normal(NamedTuple):
    """Normal distribution of intercept and slope.

    Attributes
    ----------
    mean : array [2]
        Mean intercept and mean slope.
    covariance : array [2, 2]
        Genetic covariances.
    """

    mean: Numbers
    covariance: Numbers


def selection_strength(setting: Setting) -> float:
    """Return the strength of stabilizing selection on the mean phenotype.

    The result is 1 / (V + the variance of z in the new environment).
    """
    squared_cue = setting.jump**2 + setting.noise_variance
    phenotypic_variance = setting.intercept_variance + setting.slope_variance * squared_cue
    return 1 / (setting.peak_variance + phenotypic_variance)


def response_matrix(setting: Setting) -> Numbers:
    """Return the matrix of the expected response to selection.

    The mean m of (a, b) changes by G grad ln W, and its expectation over the environment is
    -M (m - m*). The matrix M is constant if the variances G are constant.
    """
    strength = selection_strength(setting)
    jump = setting.jump
    plasticity_term = jump**2 + setting.noise_variance + setting.cost / strength
    gradient = np.array([[1.0, jump], [jump, plasticity_term]])
    variances = np.array([setting.intercept_variance, setting.slope_variance])
    matrix: Numbers = strength * variances[:, None] * gradient
    return matrix


def equilibrium(setting: Setting) -> Numbers:
    """Return the mean intercept and slope at which evolution ends.

    The slope is that of the best linear prediction of the optimum from the cue, lowered by the
    cost. The intercept makes the mean phenotype optimal.

    The result is a* = (B - b*) jump and b* = predictability B noise / (noise + cost / strength).
    """
    noise = setting.noise_variance
    slope_of_prediction = setting.predictability * setting.optimum_slope
    slope = slope_of_prediction * noise / (noise + setting.cost / selection_strength(setting))
    return np.array([(setting.optimum_slope - slope) * setting.jump, slope])


def solve_means(setting: Setting, start: Numbers, generations: int) -> Numbers:
    """Return the expected means of all generations in closed form.

    The result is m* + (1 - M)^t (start - m*), by the eigenvalues of M.
    """
    end = equilibrium(setting)
    rates, vectors = np.linalg.eig(response_matrix(setting))
    coefficients = np.linalg.solve(vectors, np.asarray(start) - end)
    decay = (1 - rates) ** np.arange(generations)[:, None]
    means: Numbers = end + (decay * coefficients) @ vectors.T
    return means


def time_constants(setting: Setting) -> tuple[float, float]:
    """Return the exact time constants of the two phases, in generations.

    They are -1 / ln(1 - rate) for the larger and the smaller eigenvalue of M, which are
    T / 2 +- sqrt(T^2 / 4 - D), with the trace T and the determinant D.
    """
    matrix = response_matrix(setting)
    half_trace = matrix.trace() / 2
    fast_rate = half_trace + (half_trace**2 - np.linalg.det(matrix)) ** 0.5
    # The product of both rates is the determinant. The difference would lose digits.
    slow_rate = np.linalg.det(matrix) / fast_rate
    return float(-1 / np.log1p(-fast_rate)), float(-1 / np.log1p(-slow_rate))


def approximate_time_constants(setting: Setting) -> tuple[float, float]:
    """Return the time constants for a jump that is large compared with the noise.

    They are 1 / (g (Gaa + Gbb jump^2)) and (Gaa + Gbb jump^2) / (g Gaa Gbb (noise + cost / g)),
    with the strength of selection g.
    """
    strength = selection_strength(setting)
    variance = setting.intercept_variance + setting.slope_variance * setting.jump**2
    product = setting.intercept_variance * setting.slope_variance
    # Selection against plasticity in the second phase: by wrong cues and by the cost.
    against_plasticity = strength * setting.noise_variance + setting.cost
    return 1 / (strength * variance), variance / (product * against_plasticity)


def plasticity_share(setting: Setting) -> float:
    """Return the fraction of the change of the phenotype by plasticity in the first phase.

    The result is Gbb jump^2 / (Gaa + Gbb jump^2).
    """
    plastic_variance = setting.slope_variance * setting.jump**2
    return plastic_variance / (setting.intercept_variance + plastic_variance)


def breed_normal(
    population: Normal, segregation: Numbers, cue: float, optimum: float, setting: Setting
) -> Normal:
    """Return the distribution in the next generation of an infinite population, exactly.

    Selection multiplies the normal density by a normal fitness. A child is the mean of two
    independent parents plus normal noise with the covariance `segregation`.
    """
    development = np.array([1.0, cue])
    precision = np.linalg.inv(population.covariance)
    selected_precision = precision + np.outer(development, development) / setting.peak_variance
    selected_precision[1, 1] += setting.cost
    selected = np.linalg.inv(selected_precision)
    pull = precision @ population.mean + development * optimum / setting.peak_variance
    return Normal(selected @ pull, selected / 2 + segregation)
