"""Sample sizes: the smallest p-value of a number of runs, and the runs that a verdict needs.

A rank test has finitely many outcomes, so its p-value has a minimum that depends on the sample
sizes alone. Where that minimum, corrected for the number of tests, is not below the level of
significance, no data can give a verdict.

Source: R. E. Tarone, Biometrics 46 (1990), for the minimum attainable p-value.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from math import comb, exp, lgamma
from typing import Literal, NamedTuple

import numpy as np

from baldwinlab.statistics import Sample, holm
from baldwinlab.statistics.rules import SIGNIFICANT

TOO_FEW = "too few runs"  # shown in place of "undecided"

EXACT = (
    1000  # runs up to which the number of orders is counted exactly, which takes long for millions
)

Test = Literal["Mann-Whitney", "Wilcoxon", "log-rank"]


class Design(NamedTuple):
    """A two-sided test and its sample sizes, before any value is known."""

    n_a: int
    n_b: int
    test: Test = "Mann-Whitney"

    @property
    def smallest_p(self) -> float:
        """The smallest p-value of these sizes; 0 for the log-rank test, which is not exact."""
        if self.test == "log-rank":
            return 0.0
        if self.test == "Wilcoxon":
            return min(1.0, 2.0 ** (1 - self.n_a))
        runs = self.n_a + self.n_b
        if runs <= EXACT:
            return min(1.0, 2 / comb(runs, self.n_a))
        return 2 * exp(lgamma(self.n_a + 1) + lgamma(self.n_b + 1) - lgamma(runs + 1))


def smallest_corrected(designs: Sequence[Design]) -> Sample:
    """The smallest p-value of each test after Holm's correction for all of them.

    Holm's corrected p-values increase with every p-value of the family, so correcting the minima
    gives a lower bound for each.
    """
    return holm([design.smallest_p for design in designs])


def required_runs(designs: Sequence[Design]) -> int:
    """The smallest number of runs of each condition with which each test can be significant."""
    for runs in count(1):
        if not _impossible([Design(runs, runs, design.test) for design in designs]).any():
            return runs
    raise AssertionError("a rank test of enough runs can be significant")


def describe_too_few(designs: Sequence[Design]) -> str:
    """The tests that cannot be significant, in one or two sentences; "" where every test can be."""
    stuck = _impossible(designs)
    if not stuck.any():
        return ""
    sizes = [size for design, one in zip(designs, stuck, strict=True) if one for size in design[:2]]
    runs = f"{min(sizes)}" if min(sizes) == max(sizes) else f"{min(sizes)} to {max(sizes)}"
    smallest = float(smallest_corrected(designs)[stuck].min())
    some = "" if stuck.all() else f"{stuck.sum()} of these tests cannot be significant. "
    return (
        f"{some}With {_counted(runs, 'run')} and {_counted(len(designs), 'test')}, "
        "the smallest corrected p-value is "
        f"{smallest:.2g}. At least {required_runs(designs)} runs are needed."
    )


def _impossible(designs: Sequence[Design]) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    return smallest_corrected(designs) >= SIGNIFICANT


def _counted(number: object, noun: str) -> str:
    return f"{number} {noun}{'' if str(number) == '1' else 's'}"
