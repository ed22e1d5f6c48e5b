"""Tests of the required number of runs against simulation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis.statistics import compare
from baldwinlab.analysis.statistics.rank_tests import holm, signed_rank_tails
from baldwinlab.analysis.statistics.significance import (
    MAX_RUNS,
    PlannedTest,
    interval_runs,
    level_of_next_test,
    levels_of_tests,
    rank_test_runs,
    signed_rank_runs,
)


@pytest.mark.parametrize(("shift", "level"), [(0.5, 0.05), (0.8, 0.05), (0.6, 0.002)])
def test_a_study_of_the_required_size_detects_the_effect_in_four_of_five_cases(
    shift: float, level: float
) -> None:
    generator = np.random.default_rng(5)
    # Enough runs that the observed effect is the true effect.
    runs = signed_rank_runs(generator.normal(shift, 1, 2000), level)
    assert runs is not None
    p_less, p_greater = signed_rank_tails(generator.normal(shift, 1, (2000, runs)))
    power = np.mean(2 * np.minimum(p_less, p_greater) < level)
    assert 0.72 < power < 0.88


@pytest.mark.parametrize("level", [0.05, 0.001])
def test_a_clear_effect_needs_the_runs_with_which_the_test_can_be_significant(
    level: float,
) -> None:
    runs = signed_rank_runs(np.arange(1.0, 9.0), level)
    assert runs is not None
    assert 2.0 ** (1 - runs) < level
    # The normal approximation needs a third more runs at most.
    assert 2.0 ** (1 - runs / 1.5) > level / 2


def test_without_an_effect_no_number_of_runs_decides() -> None:
    assert signed_rank_runs(np.array([-2.0, -1.0, 1.0, 2.0]), 0.05) is None
    nearly = np.random.default_rng(1).normal(0.001, 1, 2000)
    assert (signed_rank_runs(nearly, 0.05) or MAX_RUNS) > 1000
    # A rank test needs at least the runs with which it can be significant.
    assert rank_test_runs(PlannedTest(4, 4), 1e-12, 0.05 / 2) == 5
    assert rank_test_runs(PlannedTest(8, 8), 1.0, 0.05) is None
    assert rank_test_runs(PlannedTest(8, 8), 0.99, 0.05) is None
    # An effect on its bound is never decided.
    numbers = compare([1.0, 2.0, 3.0], [0.0, 1.0, 2.0])
    assert interval_runs(numbers, (numbers.effect, float("inf"))) is None


@pytest.mark.parametrize(("shift", "level"), [(0.5, 0.05), (0.8, 0.005)])
def test_two_samples_of_the_required_size_differ_in_four_of_five_cases(
    shift: float, level: float
) -> None:
    generator = np.random.default_rng(3)
    # Enough runs that the observed effect is the true effect.
    a, b = generator.normal(shift, 1, 2000), generator.normal(0, 1, 2000)
    p = float(stats.mannwhitneyu(a, b).pvalue)
    runs = rank_test_runs(PlannedTest(2000, 2000), p, level)
    assert runs is not None
    samples = generator.normal(shift, 1, (1000, runs)), generator.normal(0, 1, (1000, runs))
    power = np.mean(stats.mannwhitneyu(*samples, axis=1, method="asymptotic").pvalue < level)
    assert 0.75 < power < 0.85


def test_the_level_of_the_next_test_is_that_of_holms_method() -> None:
    p_values = [1e-5, 0.2, 0.4]
    level = level_of_next_test(holm([*p_values, 0.3]))
    assert level == pytest.approx(0.05 / 3)
    is_significant = [holm([*p_values, level * factor])[-1] < 0.05 for factor in (0.99, 1.01)]
    assert is_significant == [True, False]


@pytest.mark.nightly
def test_an_interval_of_the_required_runs_excludes_the_bound_in_four_of_five_cases() -> None:
    generator = np.random.default_rng(2)
    pilot = compare(generator.normal(0.3, 1, 1000), generator.normal(0, 1, 1000))
    runs = interval_runs(pilot, (0.0,))
    assert runs is not None
    pairs = [(generator.normal(0.3, 1, runs), generator.normal(0, 1, runs)) for _ in range(200)]
    assert 0.65 < np.mean([compare(a, b).low > 0 for a, b in pairs]) < 0.92


def test_a_test_is_significant_if_its_p_value_is_below_its_level() -> None:
    """The levels are those of Holm's procedure, which stops at the first large p-value."""
    generator = np.random.default_rng(3)
    for _ in range(20):
        p_values = generator.random(8) ** 6
        corrected = holm(p_values)
        assert ((p_values < levels_of_tests(corrected)) == (corrected < 0.05)).all()
