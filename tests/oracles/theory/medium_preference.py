"""Laws of learning for a preference between two media on the logit scale.

An animal with the innate preference x lays the fraction p(x) = 1 / (1 + exp(-x)) of its eggs on the
right medium. Learning raises x by d(x). Fitness is the fraction of eggs on the right medium.

References
----------
.. [1] I. Paenke, T. J. Kawecki and B. Sendhoff, "The influence of learning on evolution: a
   mathematical framework", Artificial Life 15 (2009).
.. [2] M. G. Bulmer, The Mathematical Theory of Quantitative Genetics (1980).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.signal import fftconvolve

Numbers = npt.NDArray[np.float64]
# Distance of neighboring preferences on the grid, in standard deviations.
GRID_STEP: Final = 0.1
# Number of standard deviations at which a normal distribution is cut off.
CUT: Final = 8.0


def choice_share(preference: Numbers) -> Numbers:
    """Return the fraction p(x) = 1 / (1 + exp(-x)) of eggs on the right medium."""
    share: Numbers = 1 / (1 + np.exp(-preference))
    return share


def gain_slope(preference: Numbers, shift: Numbers, shift_slope: Numbers) -> Numbers:
    """Return the slope of the logarithm of the gain of learning.

    The gain is g(x) = p(x + d) / p(x), and the slope of ln p(x) is 1 - p(x). Learning speeds the
    evolution of x where the slope is above 0, and slows it where the slope is below 0.

    The result is (1 - p(x + d)) (1 + d') - (1 - p(x)).
    """
    learned_share = choice_share(preference + shift)
    return (1 - learned_share) * (1 + shift_slope) - (1 - choice_share(preference))


class Moments(NamedTuple):
    """Mean and standard deviation of the preference in each generation.

    Attributes
    ----------
    mean : array [generation]
        Means.
    std : array [generation]
        Standard deviations.
    """

    mean: Numbers
    std: Numbers


def predict_preferences(
    initial_mean: float,
    initial_std: float,
    segregation_std: float,
    generations: int,
    learn: Callable[[Numbers], Numbers],
) -> Moments:
    """Predict the preference in an infinite population with infinitesimal inheritance.

    The density f of newborns becomes f p(x + d) by selection. A child is the mean of two
    independent parents plus normal noise. The density is computed on a grid. Generation 0 is the
    generation of the founders. `learn` returns the shifts d(x), which are 0 without learning.
    """
    widest_std = max(initial_std, 2**0.5 * segregation_std)
    step = GRID_STEP * min(initial_std, segregation_std)
    # Each generation moves the mean by less than the variance of the preference.
    reach = round((CUT * widest_std + generations * 2 * widest_std**2) / step)
    offsets: Numbers = step * np.arange(-reach, reach + 1, dtype=np.float64)
    preference = initial_mean + offsets
    density = _normal_density(offsets, initial_std)
    fitness = choice_share(preference + learn(preference))
    # The mean of two values on the grid is on a grid of half the distance.
    half_steps: Numbers = step / 2 * np.arange(-2 * reach, 2 * reach + 1, dtype=np.float64)
    segregation = _normal_density(half_steps, segregation_std)
    means, stds = [], []
    for _ in range(generations):
        density /= density.sum()
        mean = float(density @ preference)
        means.append(mean)
        stds.append(float(np.sqrt(density @ (preference - mean) ** 2)))
        parents = density * fitness
        children = fftconvolve(fftconvolve(parents, parents), segregation, "same")
        density = children[::2]
    return Moments(np.array(means), np.array(stds))


def _normal_density(deviation: Numbers, std: float) -> Numbers:
    """Return a normal density, up to a constant."""
    density: Numbers = np.exp(-0.5 * (deviation / std) ** 2)
    return density
