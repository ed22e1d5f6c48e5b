"""Tests of the comparison of two versions."""

from __future__ import annotations

from contextlib import ExitStack

import pytest
from scipy.stats import t as student_t

from benchmarks import versions


def test_the_interval_is_that_of_student() -> None:
    low, high = student_t.interval(0.95, 2, loc=0.9, scale=0.1 / 3**0.5)
    expected = f"0.900 ({low:.3f} to {high:.3f})"
    assert versions.describe_ratios([0.8, 0.9, 1.0]) == expected


@pytest.mark.nightly
def test_two_processes_of_a_version_have_the_same_results(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with ExitStack() as running:
        pair = [versions.Version(versions.NEW_FOLDER, running) for _ in range(2)]
        seconds = versions.measure(pair, versions.Batch("evo/B", [0], 2))
    assert min(seconds) > 0
    assert capsys.readouterr().out == ""
