"""Laws of foragers with two states: innate preference or learning.

The better of two resources is the state. It persists from the first step of a parent's life to
that of its child with the probability b, and from a step to the next with the probability w. An
innate tracker always takes the first state of its parent's life. A learner also begins with it,
and then takes the resource that was better in the last step.

References
----------
D. W. Stephens, "Change, regularity, and value in the evolution of animal learning", Behavioral
Ecology 2 (1991).
"""

from __future__ import annotations

import numpy as np


def tracker_payoff(between: float, within: float, steps: int) -> float:
    """Return the mean share of steps in which an innate tracker takes the better resource.

    After t steps, the state is that of the parent with the probability
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
    between, within, steps
        Arguments of `tracker_payoff`.
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

    It is (1 / T) sum over t = 1..T-1 of w - 1/2 - (b - 1/2) (2 w - 1)^t, the difference of the
    payoffs without a cost.

    Parameters
    ----------
    between, within, steps
        Arguments of `tracker_payoff`.

    Returns
    -------
    float
        Threshold. It is 0 if the states of a life are random (w = 1/2) or never change
        (b = w = 1).
    """
    return learner_payoff(between, within, steps) - tracker_payoff(between, within, steps)
