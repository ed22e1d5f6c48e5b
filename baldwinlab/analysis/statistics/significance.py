"""Significance in a family of tests: smallest p-values, required runs and false discoveries.

A rank test has finitely many outcomes, so its p-value has a minimum that depends only on the
sample sizes. If that minimum, corrected for the number of tests, is not below the level of
significance, no data can give a verdict. A number of runs that would decide a question assumes that
the effect is the observed one.

References
----------
Minimum attainable p-value: R. E. Tarone, Biometrics 46 (1990).
False discovery rate: Y. Benjamini and Y. Hochberg, Journal of the Royal Statistical Society B 57
(1995).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import count
from math import ceil, comb, exp, isfinite, lgamma, nextafter
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from scipy import stats

from baldwinlab.analysis.statistics.bootstrap import Sample
from baldwinlab.analysis.statistics.comparisons import Comparison
from baldwinlab.analysis.statistics.hypothesis_tests import holm
from baldwinlab.core.numbers import format_count

SIGNIFICANCE_LEVEL: Final = 0.05
# With fewer runs, the 95 % interval of a median has a smaller coverage, as the sign test shows.
MIN_INTERVAL_RUNS: Final = 6
# Largest number of runs for which arrangements are counted exactly. Millions take long.
MAX_EXACT_RUNS = 1000

TestMethod = Literal["Mann-Whitney", "sign", "log-rank"]
# Function that corrects the p-values of a family of tests.
Correction = Callable[[Sequence[float]], Sample]
# Probability that a study of the required size detects the effect.
POWER = 0.8
# Larger numbers of runs are not realistic.
MAX_RUNS = 10_000


class PlannedTest(NamedTuple):
    """A two-sided test and its sample sizes, before any value is known."""

    # Sizes of the samples, at least 1. For pairs, both sizes are the number of pairs.
    n_a: int
    n_b: int
    method: TestMethod = "Mann-Whitney"  # "sign" is the sign test of pairs.

    @property
    def smallest_p(self) -> float:
        """The smallest p-value of these sizes, or 0 for the log-rank test, which is not exact."""
        if self.method == "log-rank":
            return 0.0
        if self.method == "sign":
            return min(1.0, 2.0 ** (1 - self.n_a))
        n_runs = self.n_a + self.n_b
        if n_runs <= MAX_EXACT_RUNS:
            return min(1.0, 2 / comb(n_runs, self.n_a))
        # The logarithm of 1 / comb(n_runs, n_a), because lgamma(n + 1) is the logarithm of n!.
        return 2 * exp(lgamma(self.n_a + 1) + lgamma(self.n_b + 1) - lgamma(n_runs + 1))


def plan_paired_test(n_pairs: int) -> PlannedTest:
    """Return the sign test of a number of pairs."""
    return PlannedTest(n_pairs, n_pairs, "sign")


def smallest_corrected_p(tests: Sequence[PlannedTest], correct: Correction = holm) -> Sample:
    """Compute the smallest p-value of each test after the correction for all tests, [test].

    A larger p-value never makes a corrected p-value smaller. The corrected values of the smallest
    p-values are therefore lower bounds.
    """
    return correct([test.smallest_p for test in tests])


def required_runs(tests: Sequence[PlannedTest], correct: Correction = holm) -> int:
    """Compute the number of runs per condition with which every test can be significant.

    The sample sizes of the tests are not used.
    """
    for runs in count(1):
        enlarged = [PlannedTest(runs, runs, test.method) for test in tests]
        if not _is_impossible(enlarged, correct).any():
            return runs
    raise AssertionError("a rank test of enough runs can be significant")


def describe_too_few(
    tests: Sequence[PlannedTest], correct: Correction = holm, instruction: str = ""
) -> str:
    """Describe the tests that cannot be significant, or return "" if every test can be.

    Up to three sentences state the number of runs that is needed. The instruction follows, with
    this number in the place of "{runs}".
    """
    is_impossible = _is_impossible(tests, correct)
    if not is_impossible.any():
        return ""
    affected_tests = [tests[index] for index in np.flatnonzero(is_impossible).tolist()]
    sizes = [size for test in affected_tests for size in (test.n_a, test.n_b)]
    runs = f"{min(sizes)}" if min(sizes) == max(sizes) else f"{min(sizes)} to {max(sizes)}"
    smallest_p = float(smallest_corrected_p(tests, correct)[is_impossible].min())
    affected_note = ""
    if not is_impossible.all():
        affected_note = f"{is_impossible.sum()} of these tests cannot be significant. "
    sizes_note = f"With {format_count(runs, 'run')} and {format_count(len(tests), 'test')}"
    needed = required_runs(tests, correct)
    note = (
        f"{affected_note}{sizes_note}, the smallest corrected p-value is {smallest_p:.2g}. "
        f"At least {needed} runs are needed."
    )
    return f"{note} {instruction.replace('{runs}', str(needed))}".rstrip()


def _is_impossible(
    tests: Sequence[PlannedTest], correct: Correction
) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return whether each test cannot be significant, [test]."""
    return smallest_corrected_p(tests, correct) >= SIGNIFICANCE_LEVEL


def sign_test_runs(differences: Sample, level: float) -> int | None:
    """Compute the number of runs that detects the observed effect with a probability of 80 %.

    `differences` are finite values, and `level` is corrected for the other tests. The power of the
    sign test is that of the binomial distribution. The result is None if more than `MAX_RUNS` runs
    are needed.
    """
    # Probability that a difference has the sign of most differences. A tie counts half.
    probability = 0.5 + abs(float(np.sign(differences).mean())) / 2
    runs = np.arange(1, MAX_RUNS + 1)
    # Largest number of equal signs that is not significant.
    largest = stats.binom.isf(level / 2, runs, 0.5)
    sufficient = runs[stats.binom.sf(largest, runs, probability) >= POWER]
    return int(sufficient[0]) if sufficient.size else None


def level_of_next_test(corrected: Sequence[float] | Sample) -> float:
    """Compute the level of the next test that Holm's method would find significant.

    The level is the level of significance, divided by the number of tests that are not significant.
    """
    n_undecided = int((np.asarray(corrected, np.float64) >= SIGNIFICANCE_LEVEL).sum())
    return SIGNIFICANCE_LEVEL / max(1, n_undecided)


def levels_of_tests(corrected: Sequence[float] | Sample) -> Sample:
    """Compute the level at which Holm's method tests each p-value of a family.

    The level is the level of significance, divided by the number of p-values that are not smaller.
    Tests that are not significant have the level of `level_of_next_test`.
    """
    p_values = np.asarray(corrected, np.float64)
    n_not_smaller = (p_values[:, None] <= p_values).sum(axis=1)  # [test]
    levels = SIGNIFICANCE_LEVEL / np.maximum(1, n_not_smaller)
    return np.where(p_values < SIGNIFICANCE_LEVEL, levels, level_of_next_test(p_values))


def rank_test_runs(test: PlannedTest, p: float, level: float) -> int | None:
    """Compute the number of runs with which a rank test detects the observed effect.

    The normal score of p grows with the square root of the number of runs. `p` is uncorrected, and
    `level` is corrected for the other tests. The result is the number of runs of each condition for
    a probability of 80 %, or None if more than `MAX_RUNS` runs are needed.
    """
    score = float(stats.norm.isf(p / 2))
    if score <= 0:
        return None
    # The harmonic mean of the sample sizes.
    n_runs = 2 * test.n_a * test.n_b / (test.n_a + test.n_b)
    quantiles = float(stats.norm.isf(level / 2)) + float(stats.norm.ppf(POWER))
    sizes = (runs for runs in count(1) if test._replace(n_a=runs, n_b=runs).smallest_p < level)
    required = max(ceil(n_runs * (quantiles / score) ** 2), next(sizes))
    return required if required <= MAX_RUNS else None


def interval_runs(comparison: Comparison, bounds: Sequence[float]) -> int | None:
    """Compute the number of runs whose interval of the observed effect contains no bound.

    The width of an interval decreases with the square root of the number of runs. An infinite bound
    is not used. The result is the number of runs for a probability of 80 %, at least
    `MIN_INTERVAL_RUNS`, or None if the number is undefined or more than `MAX_RUNS`.
    """
    distance = min(abs(comparison.effect - bound) for bound in bounds if isfinite(bound))
    half_width = (comparison.high - comparison.low) / 2
    if not (distance > 0 and isfinite(half_width)):
        return None
    quantile = float(stats.norm.isf(SIGNIFICANCE_LEVEL / 2))
    widening = 1 + float(stats.norm.ppf(POWER)) / quantile
    n_runs = max(comparison.n_a, comparison.n_b)
    required = max(MIN_INTERVAL_RUNS, ceil(n_runs * (widening * half_width / distance) ** 2))
    return required if required <= MAX_RUNS else None


def describe_required_runs(required_runs: int | None) -> str:
    """Describe the number of runs that would decide a question; None means no realistic number."""
    number = "no realistic number of" if required_runs is None else f"about {required_runs:,}"
    return f"{number} runs would decide this if the effect is the observed one"


def q_values(p_values: Sequence[float] | Sample) -> Sample:
    """Compute the q-values of a table of tests by the method of Benjamini and Hochberg."""
    ps = np.asarray(p_values, np.float64)
    # SciPy refuses an empty table.
    return np.asarray(stats.false_discovery_control(ps)) if ps.size else ps


def critical_p_values(p_values: Sequence[float] | Sample) -> Sample:
    """Compute the p-value below which each test is significant, given all other tests.

    The q-value of a test is below the level of significance exactly if its p-value is below the
    returned p-value.
    """
    ps = np.asarray(p_values, np.float64)
    ranks = np.arange(1, ps.size + 1)
    criticals = np.empty_like(ps)
    for index in range(ps.size):
        remaining = np.sort(np.delete(ps, index))
        # Rank k is possible if k - 1 of the remaining p-values are below the limit of rank k.
        possible = np.flatnonzero(remaining * (ps.size / ranks[1:]) < SIGNIFICANCE_LEVEL)
        rank = ranks[possible[-1] + 1] if possible.size else 1
        criticals[index] = _find_limit(ps.size / rank)
    return criticals


def _find_limit(factor: float) -> float:
    """Return the smallest p-value whose product with a factor is not below the level.

    `q_values` computes the same product, so that a p-value at the limit is rounded the same way.
    """
    limit = SIGNIFICANCE_LEVEL / factor
    while limit * factor < SIGNIFICANCE_LEVEL:
        limit = nextafter(limit, 1)
    while (smaller := nextafter(limit, 0)) * factor >= SIGNIFICANCE_LEVEL:
        limit = smaller
    return limit
