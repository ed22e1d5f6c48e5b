"""Laws of strings that guess a needle: fitness, selection, and the residual share of ?.

The alleles of a string are 0, 1 and ?. In each trial of a lifetime, every ? is set to 0 or 1 at
random. The needle is the only string that gains fitness.

References
----------
.. [1] G. E. Hinton and S. J. Nowlan, "How learning can guide evolution", Complex Systems 1 (1987):
   the strings and the fitness.
.. [2] S. Wright, "The distribution of gene frequencies in populations", PNAS 23 (1937): the
   stationary distribution of an allele share in a finite population.
"""

from __future__ import annotations

from math import inf
from typing import Final

import numpy as np
from scipy.optimize import brentq

# Maximum gain in fitness above the baseline of 1.
MAX_GAIN: Final = 19.0
# Grid of the integrals of `mean_share`: number of points, and minus the log density at both ends.
GRID_POINTS: Final = 100_001
LOG_PRECISION: Final = 40.0


def expected_fitness(n_unset: float, trials: int = 1000, cost_of_trials: float = 1.0) -> float:
    """Return the mean fitness of a string without a wrong allele.

    A trial succeeds with the probability p = 2^-q, so the first success is trial t with the
    probability p (1 - p)^(t - 1). The fitness is then 1 + 19 max(0, 1 - kappa t / T).

    Parameters
    ----------
    n_unset : float
        Number q of ?. A mean number of several strings need not be an integer.
    trials : int
        Number T of trials in a lifetime.
    cost_of_trials : float
        Factor kappa of the cost of each used trial.

    Returns
    -------
    float
        Mean fitness, from 1 to 20.

    Raises
    ------
    ValueError
        If `n_unset` is below 0.
    """
    if n_unset < 0:
        raise ValueError(f"n_unset = {n_unset} must be at least 0")
    success_probability = 0.5**n_unset
    trial = np.arange(1, trials + 1)
    first_success = success_probability * (1 - success_probability) ** (trial - 1)
    gains = MAX_GAIN * np.clip(1 - cost_of_trials * trial / trials, 0, None)
    return float(1 + first_success @ gains)


def selection_against_unset(
    n_unset: float, trials: int = 1000, cost_of_trials: float = 1.0
) -> float:
    """Return the relative gain in fitness if one ? of a string becomes correct.

    The gain is s(q) = (w(q - 1) - w(q)) / w(q), with w = `expected_fitness`. If the mean number q
    is below 1, some strings have one ? and others have none, so the gain is s(1).

    Parameters
    ----------
    n_unset : float
        Number q of ? in a string, as in `expected_fitness`.
    trials : int
        Number T of trials.
    cost_of_trials : float
        Cost kappa of the trials.

    Returns
    -------
    float
        Selection coefficient s.
    """
    n_unset = max(n_unset, 1)
    fitness = expected_fitness(n_unset, trials, cost_of_trials)
    return (expected_fitness(n_unset - 1, trials, cost_of_trials) - fitness) / fitness


def balance_of_unset(
    loci: int = 20,
    trials: int = 1000,
    cost_of_trials: float = 1.0,
    mutation_rate: float = 0.01,
    period: float = inf,
    redrawn_loci: int = 2,
    population: int | None = None,
) -> float:
    """Return the share of ? at which mutation, change and selection balance.

    The balance is (n - q) mu / 3 + (k / 2) (1 - q / n) / tau = q s(q) + q mu / 3. Mutation creates
    each of the alleles 0, 1 and ? with equal probability. A wrong allele has no descendants, and
    it is as probable from ? as from a correct allele. Therefore, only mutations between ? and the
    correct allele change the share of ?. A change makes half of the redrawn loci wrong if they are
    set. Strings with ? at these loci then replace the others. The law has no fitted parameter, and
    applies to populations that have found the needle.

    Parameters
    ----------
    loci : int
        Number n of loci.
    trials : int
        Number T of trials, as in `expected_fitness`.
    cost_of_trials : float
        Cost kappa of the trials.
    mutation_rate : float
        Probability mu of a mutation per locus and birth.
    period : float
        Number tau of generations between changes. Infinite if the needle never moves.
    redrawn_loci : int
        Number k of loci that are drawn at a change.
    population : int, optional
        Number of agents, to include genetic drift. Each locus then has Wright's stationary
        distribution, with selection s x (1 - x) instead of s x. Otherwise the population is
        infinite.

    Returns
    -------
    float
        Share q / n of ?, in [0, 1]. If several shares balance, the lowest share.

    Raises
    ------
    ValueError
        If `population` is given and `mutation_rate` is 0: drift then fixes one allele.
    """
    if population is not None and mutation_rate == 0:
        raise ValueError("mutation_rate = 0 must be above 0 in a finite population")
    gain_rate = mutation_rate / 3 + redrawn_loci / (2 * loci * period)
    loss_rate = mutation_rate / 3
    if gain_rate == 0:
        return 0.0

    def surplus(share: float) -> float:
        selection = selection_against_unset(share * loci, trials, cost_of_trials)
        if population is None:
            return (1 - share) * gain_rate - share * (selection + loss_rate)
        return mean_share(gain_rate, loss_rate, selection, population) - share

    # The surplus is positive at 0. Populations with the needle are in balance at the first root.
    shares = np.linspace(0, 1, loci + 1)
    end = next(share for share in shares if surplus(share) <= 0)  # At or above the first root.
    return float(brentq(surplus, 0, end))


def mean_share(gain_rate: float, loss_rate: float, selection: float, population: int) -> float:
    """Return the mean share of an allele in Wright's stationary distribution.

    The density of the share x is proportional to
    exp(-2 N s x) x^(2 N v - 1) (1 - x)^(2 N u - 1), for haploid agents.

    Parameters
    ----------
    gain_rate : float
        Probability v with which the other alleles become this one, per birth. Above 0.
    loss_rate : float
        Probability u with which this allele becomes another one, per birth. Above 0.
    selection : float
        Selection coefficient s against the allele.
    population : int
        Number N of agents.

    Returns
    -------
    float
        Mean share.
    """
    exponents = 2 * population * np.array([gain_rate, loss_rate])
    # A grid of logit(x). The log density decreases with these exponents as slopes at both ends.
    limit = LOG_PRECISION / min(1, *exponents)
    logit = np.linspace(-limit, limit, GRID_POINTS)
    log_share, log_rest = -np.logaddexp(0, -logit), -np.logaddexp(0, logit)
    share = np.exp(log_share)
    # The derivative of x is x (1 - x), which cancels the exponents -1.
    log_density = exponents @ [log_share, log_rest] - 2 * population * selection * share
    density = np.exp(log_density - log_density.max())
    return float(density @ share / density.sum())
