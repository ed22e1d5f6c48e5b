"""Tests of the smallest p-value of a number of runs, against SciPy and all outcomes."""

from __future__ import annotations

from itertools import combinations, product
from math import comb

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis import statistics
from baldwinlab.analysis.statistics.significance import (
    PlannedTest,
    describe_too_few,
    required_runs,
    smallest_corrected_p,
)


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
def test_wilcoxon_has_no_smaller_p_value_with_any_signs_of_the_differences(runs: int) -> None:
    sizes = np.arange(1.0, runs + 1)
    outcomes = [sizes * np.array(signs) for signs in product((-1, 1), repeat=runs)]
    exact = [stats.wilcoxon(differences, method="exact").pvalue for differences in outcomes]
    assert PlannedTest(runs, runs, "Wilcoxon").smallest_p == pytest.approx(min(exact))
    assert min(map(statistics.signed_rank, outcomes)) == pytest.approx(min(exact))


@pytest.mark.parametrize("runs", [2, 5, 9, 14, 20, 30])
def test_ties_allow_no_smaller_p_value(runs: int) -> None:
    """All runs of a condition are equal. For many runs, p is the normal approximation."""
    assert statistics.compare([1.0] * runs, [0.0] * runs).p >= PlannedTest(runs, runs).smallest_p
    assert statistics.signed_rank(np.ones(runs)) >= PlannedTest(runs, runs, "Wilcoxon").smallest_p


def test_the_smallest_corrected_p_values_bound_those_of_any_data() -> None:
    generator = np.random.default_rng(5)
    pairs = PlannedTest(5, 5, "Wilcoxon")
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
            statistics.signed_rank(c[0] - c[1]),
            statistics.mann_whitney(*d)[1],
        ]
        assert (statistics.holm(ps) >= bound - 1e-12).all()


@pytest.mark.parametrize(
    ("tests", "kind"), [(1, "Mann-Whitney"), (2, "Mann-Whitney"), (9, "Wilcoxon"), (28, "Wilcoxon")]
)
def test_one_run_less_than_required_is_too_few(tests: int, kind: str) -> None:
    designs = [PlannedTest(1, 1, kind)] * tests  # type: ignore[arg-type]
    runs = required_runs(designs)
    smallest = [tests * PlannedTest(number, number, kind).smallest_p for number in (runs - 1, runs)]  # type: ignore[arg-type]
    assert smallest[1] < 0.05 <= smallest[0]


def test_the_description_states_the_required_number_of_runs() -> None:
    assert describe_too_few([PlannedTest(6, 6, "Wilcoxon")] * 9) == (
        "With 6 runs and 9 tests, the smallest corrected p-value is 0.28. "
        "At least 9 runs are needed."
    )
    assert describe_too_few([PlannedTest(8, 8, "Wilcoxon")] * 28) == (
        "With 8 runs and 28 tests, the smallest corrected p-value is 0.22. "
        "At least 11 runs are needed."
    )
    assert describe_too_few([PlannedTest(1, 1)]) == (
        "With 1 run and 1 test, the smallest corrected p-value is 1. At least 4 runs are needed."
    )
    assert describe_too_few([PlannedTest(11, 11, "Wilcoxon")] * 28) == describe_too_few([]) == ""
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
