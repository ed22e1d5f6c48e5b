"""Tests of families of tests against Holm's method by hand."""

from __future__ import annotations

from math import nan

import pytest

from baldwinlab.analysis.results.verdicts import correct_family, explain_verdict
from baldwinlab.analysis.statistics.significance import PlannedTest, rank_test_runs

NOTHING = nan


def test_a_family_is_corrected_together_and_tests_without_p_are_left_out() -> None:
    planned = PlannedTest(8, 8)
    family = correct_family(
        {"first": (planned, 0.01), "undefined": (planned, nan), "second": (planned, 0.04)}
    )
    assert list(family) == ["first", "second"]
    first, second = family.values()
    # Holm's method multiplies the smaller p-value by 2, and the larger by 1.
    assert (first.p_holm, second.p_holm) == (0.02, 0.04)
    assert (first.level, second.level) == (0.025, 0.05)
    assert first.is_significant and second.is_significant
    # Two tests of 8 and 8 runs: twice 2 / 12870 for the smallest p-value.
    assert first.smallest_p_holm == pytest.approx(4 / 12870)
    assert correct_family({}) == {}


def test_a_test_that_cannot_be_significant_has_too_few_runs_and_needs_more() -> None:
    planned = PlannedTest(3, 3)
    (test,) = correct_family({"": (planned, 0.1)}).values()
    assert test.smallest_p_holm == pytest.approx(0.1)
    assert test.has_too_few_runs and not test.is_significant
    assert test.required_runs == rank_test_runs(planned, 0.1, 0.05)
    assert test.explain(-1.0, 1.0, is_decided=False).startswith(f"about {test.required_runs} runs")
    assert test.explain(-1.0, 1.0, is_decided=True) == ""


@pytest.mark.parametrize(
    ("low", "high", "p_holm", "is_explained"),
    [
        (1.0, 2.0, 0.01, False),
        (-1.0, 2.0, 0.2, False),
        (1.0, 2.0, 0.2, True),
        (-1.0, 2.0, 0.01, True),
        (NOTHING, NOTHING, 1.0, False),
    ],
)
def test_the_deciding_number_is_named_if_the_interval_disagrees(
    low: float, high: float, p_holm: float, is_explained: bool
) -> None:
    note = explain_verdict(low, high, p_holm)
    expected = f"the corrected p {p_holm} decides, not the interval of this comparison alone"
    assert note == (expected if is_explained else "")
    assert explain_verdict(low, high, p_holm, "9 runs").endswith("9 runs")
