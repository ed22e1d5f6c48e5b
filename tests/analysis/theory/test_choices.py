"""Laws of exploration and of two states, against integrals, simulation and limits."""

from __future__ import annotations

from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from baldwinlab.analysis.theory.choices import (
    Bandit,
    compute_payoff,
    cost_threshold,
    find_best_exploration,
    learner_payoff,
    tracker_payoff,
)
from tests.oracles.theory.best_bandit_strategy import compute_optimal_payoff

SETTINGS = [(0.5, 0.7, 3), (0.9, 0.6, 4), (0.2, 0.8, 5), (1.0, 0.95, 6), (0.7, 0.1, 2)]
BANDITS = [Bandit(100, 2.0, 3.0), Bandit(30, 0.5, 1.0), Bandit(10, 1.0, 4.0)]


def enumerate_payoffs(between: float, within: float, steps: int) -> tuple[float, float]:
    """Return the mean payoffs of a tracker and of a learner, over all lives after the state 1."""
    payoffs = np.zeros(2)
    for states in product([0, 1], repeat=steps):
        probability = between if states[0] == 1 else 1 - between
        for previous, state in pairwise(states):
            probability *= within if state == previous else 1 - within
        choices = [1, *states[:-1]]
        learner = np.mean([choice == state for choice, state in zip(choices, states, strict=True)])
        payoffs += probability * np.array([np.mean(states), learner])
    return float(payoffs[0]), float(payoffs[1])


@pytest.mark.parametrize(("between", "within", "steps"), SETTINGS)
def test_payoffs_are_means_over_all_sequences_of_states(
    between: float, within: float, steps: int
) -> None:
    tracker, learner = enumerate_payoffs(between, within, steps)
    assert tracker_payoff(between, within, steps) == pytest.approx(tracker, abs=1e-12)
    assert learner_payoff(between, within, steps, 0.1) == pytest.approx(learner - 0.1, abs=1e-12)
    assert cost_threshold(between, within, steps) == pytest.approx(learner - tracker, abs=1e-12)


@pytest.mark.parametrize(
    ("within", "expected"),
    [
        (1.0, [0.45, 0.27, 0.09, 0.009, 0]),
        (0.95, [0.405, 0.295, 0.184, 0.135, 0.129]),
        (0.8, [0.27, 0.24, 0.21, 0.20, 0.20]),
        (0.6, [0.09, 0.085, 0.08, 0.078, 0.078]),
        (0.5, [0, 0, 0, 0, 0]),
    ],
)
def test_thresholds_have_the_values_of_the_first_trials(
    within: float, expected: list[float]
) -> None:
    thresholds = [cost_threshold(between, within, 10) for between in (0.5, 0.7, 0.9, 0.99, 1)]
    assert thresholds == pytest.approx(expected, abs=0.0055 if within == 0.8 else 6e-4)


def test_learning_never_pays_in_random_or_constant_states_or_in_one_step() -> None:
    for between in (0.0, 0.3, 1.0):
        assert cost_threshold(between, 0.5, 10) == 0
        assert cost_threshold(between, 0.9, 1) == 0
    assert cost_threshold(1, 1, 10) == 0
    # Learning pays more if lives differ more.
    for within in (0.6, 0.8, 1.0):
        thresholds = [cost_threshold(between, within, 10) for between in (0.5, 0.7, 0.9, 1.0)]
        assert (np.diff(thresholds) < 0).all()
    # Long lives approach the payoff of the last state.
    assert cost_threshold(0.9, 0.8, 10**6) == pytest.approx(0.8 - 0.5, abs=1e-5)


def integrate_payoff(explored: int, bandit: Bandit) -> float:
    """Return the mean payoff from its definition: accept arm 2 if the sum exceeds a threshold."""
    # The posterior mean is above 0 if m / u^2 + S / s^2 is above 0.
    threshold = bandit.noise**2 / bandit.uncertainty**2

    def accepted_payoff(mean: float) -> float:
        excess = (explored * mean - threshold) / (np.sqrt(explored) * bandit.noise)
        prior = norm.pdf(mean, -1, bandit.uncertainty)
        return float(mean * norm.cdf(excess) * prior)

    width = 10 * bandit.uncertainty
    accepted, _ = quad(accepted_payoff, -1 - width, -1 + width, epsabs=1e-12, limit=400, points=[0])
    return -explored + (bandit.pulls - explored) * accepted


def positive_part(sd: float) -> float:
    """Return the mean of the positive part of a normal number with the mean -1."""
    return float(sd * norm.pdf(1 / sd) - norm.cdf(-1 / sd))


@pytest.mark.parametrize("bandit", BANDITS)
@pytest.mark.parametrize("explored", [1, 2, 6, 10])
def test_the_payoff_is_the_integral_over_all_lifetimes(bandit: Bandit, explored: int) -> None:
    expected = integrate_payoff(explored, bandit)
    assert float(compute_payoff(explored, bandit)) == pytest.approx(expected, abs=1e-8)


def test_the_payoff_has_its_limits() -> None:
    bandit = Bandit(50, 1.5, 0.0)
    assert float(compute_payoff(0, bandit)) == 0
    assert float(compute_payoff(50, bandit)) == -50, "arm 2 in all pulls"
    one_pull = -1 + 49 * positive_part(1.5)
    assert float(compute_payoff(1, bandit)) == pytest.approx(one_pull, abs=1e-12), "no noise"


def test_learning_pays_with_uncertainty_long_lives_and_little_noise() -> None:
    # A change of one factor can make exploration useless.
    assert find_best_exploration(Bandit(100, 2.0, 3.0)).pulls == 6
    for bandit in (Bandit(100, 0.5, 3.0), Bandit(100, 2.0, 30.0), Bandit(5, 2.0, 3.0)):
        assert find_best_exploration(bandit) == (0, 0.0)
        assert compute_optimal_payoff(bandit) == pytest.approx(0, abs=1e-6)

    # The best payoff is monotone in each factor.
    def best(**changes: Any) -> float:
        return find_best_exploration(Bandit(100, 2.0, 3.0)._replace(**changes)).payoff

    assert best(uncertainty=1.5) < best() < best(uncertainty=3.0)
    assert best(noise=5.0) < best() < best(noise=1.0)
    assert best(pulls=50) < best() < best(pulls=200)


@pytest.mark.parametrize("bandit", [Bandit(20, 1.0, 1.0), Bandit(50, 2.0, 3.0)])
def test_the_best_strategy_is_at_least_as_good_as_the_best_exploration(bandit: Bandit) -> None:
    assert compute_optimal_payoff(bandit) >= find_best_exploration(bandit).payoff - 1e-6


def test_the_best_strategy_of_short_and_exact_lives_is_known() -> None:
    assert compute_optimal_payoff(Bandit(1, 5.0, 1.0)) == 0
    # After one pull, the posterior mean has the standard deviation u^2 / sqrt(u^2 + s^2).
    sd = 25 / np.sqrt(26)
    two_pulls = -1 + positive_part(sd)
    assert compute_optimal_payoff(Bandit(2, 5.0, 1.0)) == pytest.approx(two_pulls, abs=1e-4)
    # Without noise one pull tells the best arm.
    nearly_exact = compute_optimal_payoff(Bandit(20, 2.0, 1e-4))
    assert nearly_exact == pytest.approx(-1 + 19 * positive_part(2.0), abs=1e-3)


def test_the_best_strategy_of_three_pulls_is_that_of_nested_integrals() -> None:
    """The value of the second pull is an integral in the integral over the first payoff."""
    uncertainty, noise = 2.0, 1.5
    variances = [1 / (1 / uncertainty**2 + n / noise**2) for n in range(3)]
    first, second = (float(np.sqrt(variances[n] - variances[n + 1])) for n in range(2))

    def value_of_last_two(mean: float) -> float:
        last = mean * norm.cdf(mean / second) + second * norm.pdf(mean / second)
        return max(0.0, float(mean + last))

    rest, _ = quad(
        lambda mean: value_of_last_two(mean) * norm.pdf(mean, -1, first), -20, 20, points=[0]
    )
    optimal = compute_optimal_payoff(Bandit(3, uncertainty, noise))
    assert optimal == pytest.approx(max(0.0, -1 + rest), abs=1e-4)
