"""Test the laws of a moving optimum against limits and plain recursions."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, inf, sqrt

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.analysis.theory.moving_optimum import (
    selection_variance,
    steady_mismatch,
    variance_of_mutations,
    variance_of_segregation,
)
from tests.oracles.theory.rare_mutations import variance_of_rare_mutations

Density = npt.NDArray[np.float64]
# A grid of x relative to the optimum.
X = np.arange(-1000, 1001) / 100
STEP = float(X[1] - X[0])


def normal(mean: float, std: float) -> Density:
    density = np.exp(-((X - mean) ** 2) / (2 * std * std))
    return np.asarray(density / density.sum(), np.float64)


def evolve(
    density: Density, reproduce: Callable[[Density], Density], fitness: Density, shift: int
) -> Density:
    """Return the density of the next generation, relative to an optimum that moved by `shift`."""
    parents = density * fitness
    return np.roll(reproduce(parents / parents.sum()), -shift)


def mutate(rate: float, std: float) -> Callable[[Density], Density]:
    """Return a function of parents: the children of one parent, some with a normal mutation."""
    transform = np.fft.rfft(np.fft.ifftshift(normal(0, std)))

    def reproduce(parents: Density) -> Density:
        mutants = np.fft.irfft(np.fft.rfft(parents) * transform, X.size)
        return (1 - rate) * parents + rate * mutants.clip(0)

    return reproduce


@pytest.mark.parametrize(("share", "cost"), [(0.0, 0.0), (0.5, 0.0), (0.5, 0.7), (0.8, 0.05)])
def test_the_mismatch_is_that_of_a_density_on_a_grid(share: float, cost: float) -> None:
    """Every birth mutates; the density of x is followed without any assumption on its form."""
    width, shift = 1.0, 2
    fitness = np.exp(-((1 - share) ** 2 + cost * share**2) * X * X / (2 * width * width))
    density = normal(-1, 0.5)
    for _ in range(600):
        density = evolve(density, mutate(1.0, 0.3), fitness, shift)
    mean = float(density @ X)
    variance = float(density @ (X - mean) ** 2)
    expected = variance_of_mutations(0.09, selection_variance(width, share, cost))
    assert variance == pytest.approx(expected, rel=1e-6)
    mismatch = steady_mismatch(shift * STEP, share, width, variance, cost)
    assert -(1 - share) * mean == pytest.approx(mismatch, rel=1e-6)


@pytest.mark.parametrize(("share", "printed"), [(0.0, 0.42), (0.5, 0.81), (0.8, 2.004)])
def test_with_a_fixed_variance_learning_increases_the_mismatch(
    share: float, printed: float
) -> None:
    """The values of the first trials; the width and the variance only matter by their ratio."""
    assert steady_mismatch(0.02, share, 2.0, 0.2) == pytest.approx(printed)
    assert steady_mismatch(0.02, share, 1.0, 0.05) == pytest.approx(printed)


def slope_of_mismatch(variance_of: Callable[[float], float]) -> float:
    """Return the slope of ln M in ln 1 / (1 - a), for shares from 0 to 0.9."""
    shares = np.array([0, 0.3, 0.6, 0.9])
    mismatches = [
        steady_mismatch(0.02, a, 10.0, variance_of(selection_variance(10.0, a))) for a in shares
    ]
    return float(np.polyfit(-np.log(1 - shares), np.log(mismatches), 1)[0])


def test_mutation_decides_whether_learning_helps_to_follow_the_optimum() -> None:
    slopes = [
        slope_of_mismatch(lambda width: variance_of_segregation(0.1, width)),
        slope_of_mismatch(lambda width: variance_of_mutations(0.01, width)),
        slope_of_mismatch(lambda width: variance_of_rare_mutations(0.003, width)),
    ]
    assert slopes == pytest.approx([1, 0, -1], abs=0.01)
    # Mutation in each birth gives the mismatches of the first trials.
    mismatches = [
        steady_mismatch(0.02, a, 2.0, variance_of_mutations(0.01, selection_variance(2.0, a)))
        for a in (0, 0.5, 0.8)
    ]
    assert mismatches == pytest.approx([0.407, 0.407, 0.401], abs=0.004)


def test_variances_are_fixed_points_of_their_recursions() -> None:
    for width_squared in (0.5, 4.0, 100.0):
        variances = [1.0, 1.0]
        for _ in range(20_000):
            selected = [v * width_squared / (v + width_squared) for v in variances]
            variances = [selected[0] / 2 + 0.1, selected[1] + 0.01]
        assert variance_of_segregation(0.1, width_squared) == pytest.approx(variances[0])
        assert variance_of_mutations(0.01, width_squared) == pytest.approx(variances[1])
    # The variances have the limits of weak selection and small mutations.
    assert variance_of_segregation(0.1, 1e6) == pytest.approx(0.2, rel=1e-5)
    assert variance_of_mutations(1e-8, 4.0) == pytest.approx(2e-4, rel=1e-3)
    assert variance_of_mutations(0, 4.0) == variance_of_rare_mutations(0, 4.0) == 0


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_rare_mutations_give_the_variance_of_a_house_of_cards(share: float) -> None:
    """The optimum does not move. The law is a limit, so it is met to within 15 %."""
    rate, width = 1e-5, 1.0
    fitness = np.exp(-((1 - share) ** 2) * X * X / (2 * width * width))
    density = (X == 0) * 1.0
    for _ in range(1500):
        density = evolve(density, mutate(rate, 0.7), fitness, 0)
    expected = variance_of_rare_mutations(rate, selection_variance(width, share))
    assert float(density @ X**2) == pytest.approx(expected, rel=0.15)


def test_the_limits_of_the_learned_share() -> None:
    assert selection_variance(2.0, 0.0) == 4
    assert selection_variance(2.0, 1.0) == inf
    assert selection_variance(2.0, 1.0, cost=0.25) == 16
    assert steady_mismatch(0.02, 1.0, 2.0, 0.2) == inf
    assert steady_mismatch(0.02, 1.0, 2.0, 0.2, cost=1.0) == 0
    assert steady_mismatch(0.0, 0.5, 2.0, 0.2) == 0
    # The width of selection is that of fitness at birth.
    share, cost, width, distance = 0.6, 0.4, 1.5, 0.7
    after = (1 - share) * distance
    fitness = exp(-(after**2 + cost * (share * distance) ** 2) / (2 * width**2))
    squared = selection_variance(width, share, cost)
    assert fitness == pytest.approx(exp(-(distance**2) / (2 * squared)))
    assert sqrt(squared) > width
