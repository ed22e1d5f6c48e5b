"""Curves as one line of text."""

from __future__ import annotations

import math

import pytest

from baldwinlab.core import sparkline
from baldwinlab.core.sparkline import BARS, FitnessCurves, draw_sparkline


def test_a_bar_is_the_share_of_the_highest_value() -> None:
    assert draw_sparkline(range(8), 8) == BARS
    assert draw_sparkline([0, 5, 10], 8) == "▁▅█"
    assert draw_sparkline([3, 3], 8) == "██"
    assert draw_sparkline([0, 0], 8) == "▁▁"
    assert draw_sparkline([], 8) == ""


def test_neighboring_values_share_a_bar() -> None:
    assert draw_sparkline([0, 0, 8, 8, 0, 16], 3) == "▁██"


def test_undefined_values_are_gaps_and_negative_values_are_below_zero() -> None:
    assert draw_sparkline([1, math.nan, 1], 3) == "█ █"
    assert draw_sparkline([-7, 0, 7], 3) == "▁▅█"


def test_the_line_of_a_study_averages_runs_and_stays_with_one_condition(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    curves = FitnessCurves()
    assert str(curves) == ""
    for run_fitness in (10.0, 30.0):
        curves.add("evo/A", 0, run_fitness)
    curves.add("other", 0, 5.0)
    curves.add("evo/A", 1, 40.0)
    assert str(curves) == "evo/A ▅█ 40"
    monkeypatch.setattr(sparkline, "MAX_SILENCE", -1.0)
    curves.add("other", 1, 7.0)
    assert str(curves) == "other ▆█ 7"
