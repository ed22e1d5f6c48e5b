"""Laws of a preference between two media, against brute force and their limits."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from tests.oracles.theory.medium_preference import choice_share, gain_slope, predict_preferences

Numbers = npt.NDArray[np.float64]
X: Numbers = np.linspace(-8, 8, 1601)


def shift_by_visits(x: Numbers, right: float, wrong: float, size: float) -> Numbers:
    """A shift in proportion to p^right (1 - p)^wrong."""
    share = choice_share(x)
    shift: Numbers = size * share**right * (1 - share) ** wrong
    return shift


def slope_by_visits(x: Numbers, right: float, wrong: float, size: float) -> Numbers:
    share = choice_share(x)
    slope: Numbers = shift_by_visits(x, right, wrong, size) * (right * (1 - share) - wrong * share)
    return slope


@pytest.mark.parametrize(("right", "wrong"), [(0, 0), (0, 1), (1, 1), (2, 1), (1, 0)])
@pytest.mark.parametrize("size", [0.1, 2.0])
def test_the_slope_is_the_derivative_of_the_logarithm_of_the_gain(
    right: float, wrong: float, size: float
) -> None:
    def log_gain(x: Numbers) -> Numbers:
        learned = x + shift_by_visits(x, right, wrong, size)
        values: Numbers = np.log(choice_share(learned) / choice_share(x))
        return values

    arguments = (right, wrong, size)
    slope = gain_slope(X, shift_by_visits(X, *arguments), slope_by_visits(X, *arguments))
    derivative = (log_gain(X + 1e-5) - log_gain(X - 1e-5)) / 2e-5
    np.testing.assert_allclose(slope, derivative, atol=1e-8)


@pytest.mark.parametrize(("right", "wrong"), [(1, 1), (2, 1), (1, 0), (1, 2)])
def test_a_small_shift_speeds_evolution_below_the_predicted_share_alone(
    right: float, wrong: float
) -> None:
    arguments = (right, wrong, 1e-3)
    slope = gain_slope(X, shift_by_visits(X, *arguments), slope_by_visits(X, *arguments))
    boundary = right / (right + wrong + 1)
    share = choice_share(X)
    assert (slope[share < boundary - 0.005] > 0).all()
    assert (slope[share > boundary + 0.005] < 0).all()


@pytest.mark.parametrize("size", [1e-3, 0.5, 3.0])
@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_learning_without_visits_to_the_right_medium_always_slows(wrong: int, size: float) -> None:
    arguments = (0, wrong, size)
    slope = gain_slope(X, shift_by_visits(X, *arguments), slope_by_visits(X, *arguments))
    assert (slope < 0).all()


@pytest.mark.parametrize("mean", [-2.0, 0.0, 2.0])
def test_the_recursion_agrees_with_a_large_sample(mean: float) -> None:
    """60,000 animals, each a mean of two parents drawn in proportion to fitness, plus noise."""
    std = 0.4

    def learn(x: Numbers) -> Numbers:
        return shift_by_visits(x, 1, 1, 6.0)

    predicted = predict_preferences(mean, std, 0.25, 6, learn)
    random = np.random.default_rng(4)
    size = 60_000
    x = random.normal(mean, std, size)
    for generation in range(6):
        assert abs(x.mean() - predicted.mean[generation]) < 6 * std * np.sqrt(generation + 1) / (
            np.sqrt(size)
        )
        assert x.std() == pytest.approx(predicted.std[generation], rel=0.015)
        fitness = choice_share(x + learn(x))
        pairs = random.choice(x, (2, size), p=fitness / fitness.sum())
        x = pairs.mean(axis=0) + random.normal(0, 0.25, size)


def test_weak_selection_has_the_response_of_the_breeders_equation() -> None:
    """For a small variance, the mean rises by the variance times the slope of log fitness."""
    predicted = predict_preferences(-1.0, 0.01, 0.01, 2, np.zeros_like)
    response = predicted.mean[1] - predicted.mean[0]
    assert response == pytest.approx(1e-4 * (1 - choice_share(np.array(-1.0))), rel=1e-3)


def test_without_selection_the_distribution_stays() -> None:
    # All eggs are on the right medium, whatever the preference.
    predicted = predict_preferences(40.0, 0.3, 0.3 / 2**0.5, 5, np.zeros_like)
    np.testing.assert_allclose(predicted.mean, 40.0, atol=1e-9)
    np.testing.assert_allclose(predicted.std, 0.3, atol=1e-9)
