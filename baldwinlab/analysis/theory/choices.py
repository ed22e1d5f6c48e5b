"""Laws of choices between two options: innate preference, learning, and exploration.

**Two states.** The state is the better of two resources. It persists from the first step of a
parent's life to the first step of a child's life with the probability b, and from one step to the
next with the probability w. An innate tracker always takes the first state of the parent's life. A
learner does so in the first step, and then takes the resource that was better in the step before.

**Bandit.** When does exploration pay? Arm 1 pays 0. Arm 2 pays a random number that is normal with
the mean mu and the standard deviation `noise`. The mean mu is drawn once per lifetime: it is normal
with the mean -1 and the standard deviation `uncertainty`. A lifetime has a fixed number of pulls.

References
----------
.. [1] D. W. Stephens, "Change, regularity, and value in the evolution of animal learning",
   Behavioral Ecology 2 (1991).
.. [2] R. T. Lange and H. Sprekeler, "Learning not to learn: nature versus nurture in silico",
   arXiv 2010.04466 (2020).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.stats import norm

Floats = npt.NDArray[np.float64]
# Mean payoff of arm 2 over all lifetimes. Its size is the unit of payoff.
MEAN_PAYOFF: Final = -1.0


def tracker_payoff(between: float, within: float, steps: int) -> float:
    """Return the mean share of steps in which an innate tracker takes the better resource.

    After t steps, the state is the first state of the parent's life with the probability
    1/2 + (b - 1/2) (2 w - 1)^t.

    Parameters
    ----------
    between : float
        Persistence b between lives, in [0, 1].
    within : float
        Persistence w between steps, in [0, 1].
    steps : int
        Number T of steps in a life.

    Returns
    -------
    float
        Mean payoff, from 0 to 1.
    """
    correlations = (2 * within - 1) ** np.arange(steps)
    return float(np.mean(0.5 + (between - 0.5) * correlations))


def learner_payoff(between: float, within: float, steps: int, cost: float = 0.0) -> float:
    """Return the mean payoff of a learner: (b + (T - 1) w) / T - c.

    Parameters
    ----------
    between, within : float
        Persistence b between lives and w within a life, as in `tracker_payoff`.
    steps : int
        Number T of steps of a life.
    cost : float
        Cost c of learning in a life.

    Returns
    -------
    float
        Mean payoff.
    """
    return (between + (steps - 1) * within) / steps - cost


def cost_threshold(between: float, within: float, steps: int) -> float:
    """Return the cost c* below which learning pays.

    c* is the difference between the payoffs of learner and tracker without a cost:
    (1 / T) sum over t = 1..T-1 of w - 1/2 - (b - 1/2) (2 w - 1)^t.

    Parameters
    ----------
    between, within : float
        Persistence b between lives and w within a life, as in `tracker_payoff`.
    steps : int
        Number T of steps of a life.

    Returns
    -------
    float
        Threshold. It is 0 if the states of a life are random (w = 1/2) or never change
        (b = w = 1).
    """
    return learner_payoff(between, within, steps) - tracker_payoff(between, within, steps)


class Bandit(NamedTuple):
    """A bandit with a safe arm and an unknown arm.

    Attributes
    ----------
    pulls : int
        Number of pulls in a lifetime, T.
    uncertainty : float
        Standard deviation of the mean of arm 2 between lifetimes, above 0.
    noise : float
        Standard deviation of the payoff of arm 2 within a lifetime.
    """

    pulls: int
    uncertainty: float
    noise: float


class Exploration(NamedTuple):
    """The best number of exploratory pulls.

    Attributes
    ----------
    pulls : int
        Number of exploratory pulls, n; 0 if exploration does not pay.
    payoff : float
        Mean payoff of a lifetime; 0 if exploration does not pay.
    """

    pulls: int
    payoff: float


def compute_payoff(explored: npt.ArrayLike, bandit: Bandit) -> Floats:
    """Return the mean payoff of an agent that explores and then commits to one arm.

    The agent pulls arm 2 n times. For the rest of its life, it pulls the arm with the larger
    posterior mean. Over all lifetimes, the posterior mean of arm 2 is normal with the mean m = -1
    and the variance v^2 = u^4 / (u^2 + s^2 / n), where u is the uncertainty and s is the noise. The
    mean of max(0, posterior mean) is m Phi(m / v) + v phi(m / v).

    Parameters
    ----------
    explored : array_like
        Number of exploratory pulls n, from 0 to the number of pulls T.
    bandit : Bandit
        The bandit.

    Returns
    -------
    array
        V(n) = n m + (T - n) (m Phi(m / v) + v phi(m / v)), exact.

    References
    ----------
    Lange and Sprekeler 2020, for the question.
    """
    n = np.asarray(explored, np.float64)
    # Without exploration, the positive part is 0, because the prior mean is below 0.
    is_explored = n > 0
    evidence = np.where(is_explored, bandit.uncertainty**2 * n + bandit.noise**2, 1.0)
    sd = bandit.uncertainty**2 * np.sqrt(n / evidence)  # v of the docstring.
    d = MEAN_PAYOFF / np.where(is_explored, sd, 1.0)  # m / v, without a division by 0.
    positive_part = np.where(is_explored, MEAN_PAYOFF * norm.cdf(d) + sd * norm.pdf(d), 0.0)
    payoff: Floats = MEAN_PAYOFF * n + (bandit.pulls - n) * positive_part
    return payoff


def find_best_exploration(bandit: Bandit) -> Exploration:
    """Return the best number of exploratory pulls.

    An agent should learn if some n > 0 has a mean payoff above 0, the payoff of an agent that never
    pulls arm 2.

    Parameters
    ----------
    bandit : Bandit
        The bandit.

    Returns
    -------
    Exploration
        Best number of exploratory pulls, and the mean payoff of a lifetime.

    References
    ----------
    Lange and Sprekeler 2020, for the two regimes.
    """
    payoffs = compute_payoff(np.arange(bandit.pulls + 1), bandit)
    best = int(payoffs.argmax())
    return Exploration(best, float(payoffs[best]))
