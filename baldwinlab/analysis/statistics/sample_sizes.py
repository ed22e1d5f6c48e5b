"""Compute the smallest p-value of a number of runs, and the number of runs that a verdict needs.

A rank test has finitely many outcomes, so its p-value has a minimum that depends only on the
sample sizes. If that minimum, corrected for the number of tests, is not below the level of
significance, no data can give a verdict.

References
----------
Minimum attainable p-value: R. E. Tarone, Biometrics 46 (1990).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import count
from math import comb, exp, lgamma
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from baldwinlab.analysis.statistics.rank_tests import holm
from baldwinlab.analysis.statistics.samples import Sample

SIGNIFICANCE_LEVEL: Final = 0.05
# With fewer runs, the 95 % interval of a median has a smaller coverage, as the sign test shows.
MIN_INTERVAL_RUNS: Final = 6
# Largest number of runs for which arrangements are counted exactly. Millions take long.
MAX_EXACT_RUNS = 1000

TestMethod = Literal["Mann-Whitney", "Wilcoxon", "log-rank"]
# Function that corrects the p-values of a family of tests.
Correction = Callable[[Sequence[float]], Sample]


class PlannedTest(NamedTuple):
    """A two-sided test and its sample sizes, before any value is known.

    Attributes
    ----------
    n_a, n_b : int
        Sizes of the samples, at least 1. For pairs, both are the number of pairs.
    method : {"Mann-Whitney", "Wilcoxon", "log-rank"}
        Name of the test. "Wilcoxon" is the signed-rank test of pairs.
    """

    n_a: int
    n_b: int
    method: TestMethod = "Mann-Whitney"

    @property
    def smallest_p(self) -> float:
        """The smallest p-value of these sizes, or 0 for the log-rank test, which is not exact."""
        if self.method == "log-rank":
            return 0.0
        if self.method == "Wilcoxon":
            return min(1.0, 2.0 ** (1 - self.n_a))
        n_runs = self.n_a + self.n_b
        if n_runs <= MAX_EXACT_RUNS:
            return min(1.0, 2 / comb(n_runs, self.n_a))
        # The logarithm of 1 / comb(n_runs, n_a), because lgamma(n + 1) is the logarithm of n!.
        return 2 * exp(lgamma(self.n_a + 1) + lgamma(self.n_b + 1) - lgamma(n_runs + 1))


def plan_paired_test(n_pairs: int) -> PlannedTest:
    """Return the signed-rank test of a number of pairs."""
    return PlannedTest(n_pairs, n_pairs, "Wilcoxon")


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
    sizes_note = f"With {_format_count(runs, 'run')} and {_format_count(len(tests), 'test')}"
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


def _format_count(number: object, noun: str) -> str:
    return f"{number} {noun}{'' if str(number) == '1' else 's'}"
