"""Laws of a reaction norm after a sudden change, against iteration, integrals and limits."""

from __future__ import annotations

import numpy as np
import pytest

from tests.oracles.theory.reaction_norm import (
    Normal,
    Setting,
    approximate_time_constants,
    breed_normal,
    equilibrium,
    plasticity_share,
    response_matrix,
    selection_strength,
    solve_means,
    time_constants,
)

SETTING = Setting(
    optimum_slope=2.0,
    peak_variance=10.0,
    intercept_variance=0.5,
    slope_variance=0.2,
    jump=3.0,
    noise_variance=1.0,
    predictability=0.25,
)
SETTINGS = [
    SETTING,
    SETTING._replace(cost=0.1),
    SETTING._replace(predictability=0.9, jump=-5.0),
    SETTING._replace(noise_variance=0.0, cost=0.02),
]
START = np.array([0.0, 0.5])


@pytest.mark.parametrize("setting", SETTINGS)
def test_the_closed_form_agrees_with_the_iteration_of_the_response(setting: Setting) -> None:
    """The response is G times the gradient of ln W, averaged over cue and later environment."""
    strength = selection_strength(setting)
    mean = START
    expected = []
    for _ in range(200):
        expected.append(mean)
        intercept, slope = mean
        jump, noise = setting.jump, setting.noise_variance
        squared_cue = jump**2 + noise
        cue_and_environment = jump**2 + setting.predictability * noise
        # The means of the mismatch, and of the mismatch times the cue.
        mismatch = intercept + (slope - setting.optimum_slope) * jump
        product = intercept * jump + slope * squared_cue
        product -= setting.optimum_slope * cue_and_environment
        gradient = np.array([-strength * mismatch, -strength * product - setting.cost * slope])
        mean = mean + np.array([setting.intercept_variance, setting.slope_variance]) * gradient
    np.testing.assert_allclose(solve_means(setting, START, 200), expected, atol=1e-12, rtol=1e-12)


@pytest.mark.parametrize("setting", SETTINGS)
def test_time_constants_are_the_decay_of_both_phases(setting: Setting) -> None:
    rates, vectors = np.linalg.eig(response_matrix(setting))
    fast, slow = time_constants(setting)
    assert fast < slow
    for rate, vector in zip(rates, vectors.T, strict=True):
        distance = solve_means(setting, equilibrium(setting) + vector, 2) - equilibrium(setting)
        decay = distance[1] / distance[0]
        constant = fast if rate == rates.max() else slow
        np.testing.assert_allclose(decay, np.exp(-1 / constant), rtol=1e-9)


def test_time_constants_approach_their_limits_for_a_large_jump_and_weak_selection() -> None:
    errors = []
    for jump in (3.0, 10.0, 100.0):
        setting = SETTING._replace(jump=jump, peak_variance=1e4 * jump**2)
        ratios = np.divide(time_constants(setting), approximate_time_constants(setting))
        errors.append(np.abs(ratios - 1).max())
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-3


def test_the_first_phase_divides_the_change_between_slope_and_intercept() -> None:
    """For a jump much larger than the noise, the first phase ends long before the second."""
    setting = SETTING._replace(jump=30.0, peak_variance=1e4)
    fast, slow = time_constants(setting)
    assert slow > 1000 * fast
    intercept, slope = solve_means(setting, START, int(10 * fast))[-1]
    change = (setting.optimum_slope - START[1]) * setting.jump
    assert (slope - START[1]) * setting.jump == pytest.approx(
        plasticity_share(setting) * change, rel=0.01
    )
    assert intercept + slope * setting.jump == pytest.approx(
        setting.optimum_slope * setting.jump, rel=0.001
    )


def test_a_perfect_cue_without_cost_leaves_plasticity_unchanged() -> None:
    setting = SETTING._replace(predictability=1.0)
    means = solve_means(setting, np.array([0.0, setting.optimum_slope]), 50)
    np.testing.assert_allclose(means, [[0.0, setting.optimum_slope]] * 50, atol=1e-12)


def test_an_unpredictable_environment_removes_all_plasticity() -> None:
    intercept, slope = equilibrium(SETTING._replace(predictability=0.0))
    assert (intercept, slope) == (SETTING.optimum_slope * SETTING.jump, 0)


def test_the_equilibrium_slope_is_the_regression_of_the_optimum_on_the_cue() -> None:
    random = np.random.default_rng(1)
    noise = random.multivariate_normal([0, 0], [[1, 0.25], [0.25, 1]], 400_000)
    cue, environment = (SETTING.jump + noise).T
    slope, intercept = np.polyfit(cue, SETTING.optimum_slope * environment, 1)
    np.testing.assert_allclose(equilibrium(SETTING), [intercept, slope], atol=0.05)


def test_selection_and_inheritance_of_a_normal_population_agree_with_integrals() -> None:
    setting = SETTING._replace(peak_variance=2.0, cost=0.3)
    population = Normal(np.array([0.4, 0.7]), np.array([[0.5, 0.1], [0.1, 0.2]]))
    segregation = np.diag([0.25, 0.1])
    cue, optimum = 2.3, 4.1
    children = breed_normal(population, segregation, cue, optimum, setting)
    axis = np.linspace(-6, 6, 1201)
    intercept, slope = np.meshgrid(axis, axis, indexing="ij")
    deviation = np.stack([intercept - 0.4, slope - 0.7])
    form = np.einsum("iab,ij,jab->ab", deviation, np.linalg.inv(population.covariance), deviation)
    mismatch = intercept + slope * cue - optimum
    density = np.exp(-form / 2 - mismatch**2 / (2 * 2.0) - 0.3 * slope**2 / 2)
    density /= density.sum()
    mean = np.array([(density * intercept).sum(), (density * slope).sum()])
    centered = np.stack([intercept - mean[0], slope - mean[1]])
    covariance = np.einsum("ab,iab,jab->ij", density, centered, centered)
    np.testing.assert_allclose(children.mean, mean, atol=1e-9)
    np.testing.assert_allclose(children.covariance, covariance / 2 + segregation, atol=1e-9)


def test_the_closed_form_is_the_limit_of_the_exact_recursion_under_weak_selection() -> None:
    """Without noise, and with a wide peak, the covariances stay nearly constant."""
    setting = SETTING._replace(peak_variance=2000.0, noise_variance=0.0, cost=1e-4)
    covariance = np.diag([setting.intercept_variance, setting.slope_variance])
    population = Normal(START, covariance)
    expected = solve_means(setting, START, 3000)
    optimum = setting.optimum_slope * setting.jump
    for generation in range(3000):
        assert population.mean == pytest.approx(expected[generation], abs=0.01)
        population = breed_normal(population, covariance / 2, setting.jump, optimum, setting)
