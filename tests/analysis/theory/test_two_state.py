"""Test the laws of foragers with two states by enumeration of all sequences of states."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest

from baldwinlab.analysis.theory.choices import (
    cost_threshold,
    learner_payoff,
    tracker_payoff,
)

SETTINGS = [(0.5, 0.7, 3), (0.9, 0.6, 4), (0.2, 0.8, 5), (1.0, 0.95, 6), (0.7, 0.1, 2)]


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
