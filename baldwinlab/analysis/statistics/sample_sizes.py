"""Compute the smallest p-value of a number of runs, and the number of runs that a verdict needs.

A rank test has finitely many outcomes, so its p-value has a minimum that depends only on the
sample sizes. If that minimum, corrected for the number of tests, is not below the level of
significance, no data can give a verdict.

References
----------
Minimum attainable p-value: R. E. Tarone, Biometrics 46 (1990).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from math import comb, exp, lgamma
from typing import Any, Literal, NamedTuple

import numpy as np

from baldwinlab.analysis.statistics.rank_tests import holm
from baldwinlab.analysis.statistics.rules import SIGNIFICANT
from baldwinlab.analysis.statistics.samples import Sample

# Shown instead of "undecided".
TOO_FEW = "too few runs"
# Runs up to which the orders are counted exactly. It takes long for millions.
MAX_EXACT_RUNS = 1000

Test = Literal["Mann-Whitney", "Wilcoxon", "log-rank"]


class Design(NamedTuple):
    """A two-sided test and its sample sizes, before any value is known.

    Attributes
    ----------
    n_a, n_b : int
        Sizes of the samples, at least 1. For pairs, both are the number of pairs.
    test : {"Mann-Whitney", "Wilcoxon", "log-rank"}
        The test.
    """

    n_a: int
    n_b: int
    test: Test = "Mann-Whitney"

    @property
    def smallest_p(self) -> float:
        """The smallest p-value of these sizes, or 0 for the log-rank test, which is not exact."""
        if self.test == "log-rank":
            return 0.0
        if self.test == "Wilcoxon":
            return min(1.0, 2.0 ** (1 - self.n_a))
        runs = self.n_a + self.n_b
        if runs <= MAX_EXACT_RUNS:
            return min(1.0, 2 / comb(runs, self.n_a))
        return 2 * exp(lgamma(self.n_a + 1) + lgamma(self.n_b + 1) - lgamma(runs + 1))


def smallest_corrected(designs: Sequence[Design]) -> Sample:
    """Compute the smallest p-value of each test after Holm's correction for all tests.

    Holm's corrected p-values increase with every p-value of the family. So the corrected minima are
    a lower bound for each test.

    Parameters
    ----------
    designs
        All tests of the family.

    Returns
    -------
    Sample
        The smallest corrected p-values, [test].
    """
    return holm([design.smallest_p for design in designs])


def required_runs(designs: Sequence[Design]) -> int:
    """Compute the number of runs per condition with which every test can be significant.

    Parameters
    ----------
    designs
        All tests of the family; their sample sizes are not used.

    Returns
    -------
    int
        The smallest such number of runs.
    """
    for runs in count(1):
        enlarged = [Design(runs, runs, design.test) for design in designs]
        if not _cannot_be_significant(enlarged).any():
            return runs
    raise AssertionError("a rank test of enough runs can be significant")


def describe_too_few(designs: Sequence[Design]) -> str:
    """Describe the tests that cannot be significant.

    Parameters
    ----------
    designs
        All tests of the family.

    Returns
    -------
    str
        Up to three sentences, with the number of runs that is needed. Empty if every test can be
        significant.
    """
    impossible = _cannot_be_significant(designs)
    if not impossible.any():
        return ""
    affected = [design for design, flag in zip(designs, impossible, strict=True) if flag]
    sizes = [size for design in affected for size in design[:2]]
    runs = f"{min(sizes)}" if min(sizes) == max(sizes) else f"{min(sizes)} to {max(sizes)}"
    smallest = float(smallest_corrected(designs)[impossible].min())
    some = "" if impossible.all() else f"{impossible.sum()} of these tests cannot be significant. "
    return (
        f"{some}With {_with_noun(runs, 'run')} and {_with_noun(len(designs), 'test')}, "
        f"the smallest corrected p-value is {smallest:.2g}. "
        f"At least {required_runs(designs)} runs are needed."
    )


def _cannot_be_significant(designs: Sequence[Design]) -> np.ndarray[Any, np.dtype[np.bool_]]:
    return smallest_corrected(designs) >= SIGNIFICANT


def _with_noun(number: object, noun: str) -> str:
    return f"{number} {noun}{'' if str(number) == '1' else 's'}"
