"""Progress is a bar or a plain line, and curves are lines of text."""

from __future__ import annotations

import math
import sys
from types import ModuleType

import pytest

from baldwinlab.core import console
from baldwinlab.core.console import BARS, FitnessCurves, draw_sparkline


def test_without_a_terminal_progress_ends_with_a_plain_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with console.progress("simulating", 10) as show:
        show(4)
        show(6)
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith("simulating: 100%, ")
    assert line.endswith(" agent-steps/s, 0 s left")


def test_a_notebook_updates_a_single_progress_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    updates: list[str] = []

    class DisplayHandle:
        def __init__(self, content: str, display_id: bool) -> None:
            assert display_id

        def update(self, content: str) -> None:
            updates.append(content)

    notebook = ModuleType("IPython.display")
    notebook.HTML = str  # type: ignore[attr-defined]
    notebook.display = DisplayHandle  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", notebook)
    monkeypatch.setattr(console.console, "is_jupyter", True)
    monkeypatch.setattr(console, "BAR_INTERVAL", 0)
    with console.progress("evo <A>", 10) as show:
        show(5)
        show(5)
    half, complete = updates
    assert half.startswith('<progress value="0.500"></progress> evo &lt;A&gt;: 50%')
    assert complete.startswith('<progress value="1.000"></progress> evo &lt;A&gt;: 100%')


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
    # A batch of three runs, and one of a single run: the mean of all runs is 20.
    curves.add("evo/A", 0, 10.0, runs=3)
    curves.add("evo/A", 0, 50.0, runs=1)
    curves.add("other", 0, 5.0, runs=4)
    curves.add("evo/A", 1, 40.0, runs=3)
    assert str(curves) == "evo/A ▅█ 40"
    monkeypatch.setattr(console, "MAX_SILENCE", -1.0)
    curves.add("other", 1, 7.0, runs=4)
    assert str(curves) == "other ▆█ 7"
