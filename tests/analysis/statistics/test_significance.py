"""Smallest p-values and required runs against simulation; q-values against SciPy."""

from __future__ import annotations

from itertools import combinations, product
from math import comb

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as some
from scipy import stats

from baldwinlab.analysis import statistics
from baldwinlab.analysis.statistics import compare
from baldwinlab.analysis.statistics.hypothesis_tests import holm, sign_test
from baldwinlab.analysis.statistics.significance import (
    MAX_RUNS,
    PlannedTest,
    TestMethod,
    critical_p_values,
    describe_too_few,
    interval_runs,
    level_of_next_test,
    levels_of_tests,
    q_values,
    rank_test_runs,
    required_runs,
    sign_test_runs,
    smallest_corrected_p,
)

# The 15 p-values of the example in Benjamini and Hochberg (1995), section 4.
PUBLISHED = [
    0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344,
    0.0459, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0,
]  # fmt: skip


@pytest.mark.parametrize(("n_a", "n_b"), [(1, 1), (1, 4), (2, 2), (2, 5), (3, 3), (4, 3), (4, 4)])
def test_mann_whitney_has_no_smaller_p_value_in_any_order_of_the_runs(n_a: int, n_b: int) -> None:
    values = np.arange(n_a + n_b, dtype=float)
    outcomes = [
        (values[list(chosen)], np.delete(values, chosen))
        for chosen in combinations(range(values.size), n_a)
    ]
    exact = [
        stats.mannwhitneyu(a, b, alternative="two-sided", method="exact").pvalue
        for a, b in outcomes
    ]
    ours = [statistics.mann_whitney(a, b)[1] for a, b in outcomes if min(n_a, n_b) < 4]
    assert PlannedTest(n_a, n_b).smallest_p == pytest.approx(min(exact))
    assert min(ours, default=1.0) >= PlannedTest(n_a, n_b).smallest_p - 1e-12


@pytest.mark.parametrize("runs", range(1, 9))
def test_pairs_have_no_smaller_p_value_with_any_signs_of_the_differences(runs: int) -> None:
    outcomes = np.array(list(product((-1.0, 1.0), repeat=runs)))
    smallest = float(sign_test(outcomes).min())
    assert PlannedTest(runs, runs, "sign").smallest_p == pytest.approx(smallest)


@pytest.mark.parametrize("runs", [2, 5, 9, 14, 20, 30])
def test_ties_allow_no_smaller_p_value(runs: int) -> None:
    """All runs of a condition are equal. For many runs, p is the normal approximation."""
    assert statistics.compare([1.0] * runs, [0.0] * runs).p >= PlannedTest(runs, runs).smallest_p
    assert sign_test(np.ones((1, runs)))[0] >= PlannedTest(runs, runs, "sign").smallest_p


def test_the_smallest_corrected_p_values_bound_those_of_any_data() -> None:
    generator = np.random.default_rng(5)
    pairs = PlannedTest(5, 5, "sign")
    designs = [PlannedTest(3, 3), PlannedTest(4, 6), pairs, PlannedTest(6, 6)]
    bound = smallest_corrected_p(designs)
    for _ in range(200):
        a, b, c, d = (
            [generator.normal(4 * side, 1, size) for side, size in enumerate(design[:2])]
            for design in designs
        )
        ps = [
            statistics.mann_whitney(*a)[1],
            statistics.mann_whitney(*b)[1],
            float(sign_test((c[0] - c[1])[None])[0]),
            statistics.mann_whitney(*d)[1],
        ]
        assert (statistics.holm(ps) >= bound - 1e-12).all()


@pytest.mark.parametrize(
    ("tests", "kind"), [(1, "Mann-Whitney"), (2, "Mann-Whitney"), (9, "sign"), (28, "sign")]
)
def test_one_run_less_than_required_is_too_few(tests: int, kind: TestMethod) -> None:
    designs = [PlannedTest(1, 1, kind)] * tests
    runs = required_runs(designs)
    smallest = [tests * PlannedTest(number, number, kind).smallest_p for number in (runs - 1, runs)]
    assert smallest[1] < 0.05 <= smallest[0]


def test_the_description_states_the_required_number_of_runs() -> None:
    assert describe_too_few([PlannedTest(6, 6, "sign")] * 9) == (
        "With 6 runs and 9 tests, the smallest corrected p-value is 0.28. "
        "At least 9 runs are needed."
    )
    assert describe_too_few([PlannedTest(8, 8, "sign")] * 28) == (
        "With 8 runs and 28 tests, the smallest corrected p-value is 0.22. "
        "At least 11 runs are needed."
    )
    assert describe_too_few([PlannedTest(1, 1)]) == (
        "With 1 run and 1 test, the smallest corrected p-value is 1. At least 4 runs are needed."
    )
    assert describe_too_few([PlannedTest(11, 11, "sign")] * 28) == describe_too_few([]) == ""
    assert describe_too_few([PlannedTest(10**8, 10**8)] * 4) == ""
    assert PlannedTest(3, 3, "log-rank").smallest_p == 0, "this test has no minimum"
    # The description counts only tests that cannot be significant.
    # 2 / 45 is corrected for one test after the other.
    assert describe_too_few([PlannedTest(2, 8), PlannedTest(30, 30)]) == ""
    assert describe_too_few([PlannedTest(2, 5), PlannedTest(30, 30)]) == (
        "1 of these tests cannot be significant. "
        "With 2 to 5 runs and 2 tests, the smallest corrected p-value is 0.095. "
        "At least 5 runs are needed."
    )


@pytest.mark.parametrize(("n_a", "n_b"), [(1, 1000), (2, 999), (1000, 1), (600, 600)])
def test_the_p_value_of_many_runs_is_that_of_counting_all_orders(n_a: int, n_b: int) -> None:
    assert PlannedTest(n_a, n_b).smallest_p == pytest.approx(2 / comb(n_a + n_b, n_a), rel=1e-9)


@pytest.mark.parametrize(("shift", "level"), [(0.5, 0.05), (0.8, 0.05), (0.6, 0.002)])
def test_a_study_of_the_required_size_detects_the_effect_in_four_of_five_cases(
    shift: float, level: float
) -> None:
    # Quantiles instead of random values: the observed effect is the true effect.
    runs = sign_test_runs(shift + stats.norm.ppf((np.arange(2000) + 0.5) / 2000), level)
    assert runs is not None
    generator = np.random.default_rng(5)
    power = np.mean(sign_test(generator.normal(shift, 1, (2000, runs))) < level)
    assert 0.77 < power < 0.88


@pytest.mark.parametrize("level", [0.05, 0.001])
def test_a_clear_effect_needs_the_runs_with_which_the_test_can_be_significant(
    level: float,
) -> None:
    runs = sign_test_runs(np.arange(1.0, 9.0), level)
    assert runs is not None
    assert 2.0 ** (1 - runs) < level <= 2.0 ** (2 - runs)


def test_without_an_effect_no_number_of_runs_decides() -> None:
    assert sign_test_runs(np.array([-2.0, -1.0, 1.0, 2.0]), 0.05) is None
    nearly = np.random.default_rng(1).normal(0.001, 1, 2000)
    assert (sign_test_runs(nearly, 0.05) or MAX_RUNS) > 1000
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


def test_q_values_are_those_of_the_definition() -> None:
    assert int(np.sum(q_values(PUBLISHED) < 0.05)) == 4
    # Q values are those of the definition.
    p = np.array(PUBLISHED)
    n = p.size
    expected = [min(min(1, p[k] * n / (k + 1)) for k in range(i, n)) for i in range(n)]
    assert q_values(PUBLISHED) == pytest.approx(expected)
    # An empty table has no q values.
    assert q_values([]).size == 0 and critical_p_values([]).size == 0


# The third p-value equals the limit of the third rank, which 0.05 * 3 / 3 exceeds by rounding.
@example([0.002, 0.002, 0.05])
@example([0.002] * 7)
@given(some.lists(some.integers(1, 100).map(lambda number: number / 500), min_size=1, max_size=9))
def test_a_test_is_significant_exactly_below_its_critical_p_value(ps: list[float]) -> None:
    criticals = critical_p_values(ps)
    for index, critical in enumerate(criticals):
        for p in (critical * 0.999, np.nextafter(critical, 0), critical, critical * 1.001):
            changed = [*ps[:index], p, *ps[index + 1 :]]
            assert (q_values(changed)[index] < 0.05) == (p < critical)
