"""Progress is a bar or a plain line, and curves are lines of text."""

from __future__ import annotations

import json
import math
import sys
import tomllib
from types import ModuleType

import pytest
from rich.table import Table
from rich.text import Text

from baldwinlab.core import console
from baldwinlab.core.console import BARS, FitnessCurves, draw_sparkline

# An escape sequence, a title of a terminal, a carriage return, a C1 control, a text from right to
# left, a line separator, a byte that is no UTF-8, and markup and emoji of rich.
HOSTILE = "\x1b[31mred\x1b]0;title\x07\r\x9b\u202eevil\u2028\udcff[bold][/x]:fire:"
SHOWN = (
    "\\u001b[31mred\\u001b]0;title\\u0007\\u000d\\u009b\\u202eevil\\u2028\\udcff[bold][/x]:fire:"
)


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


def test_third_party_text_reaches_no_terminal_as_a_control(
    capsys: pytest.CaptureFixture[str],
) -> None:
    table = Table(title=HOSTILE, caption=HOSTILE)
    table.add_column(HOSTILE, no_wrap=True)
    table.add_row(HOSTILE)
    # `Text` drops a carriage return and a bell before a console has the text.
    styled_text = Text.assemble((HOSTILE, "bold"))
    console.info(HOSTILE)
    console.warn(HOSTILE)
    console.console.print(table, width=200)
    console.console.print(styled_text, width=200)
    with console.progress(HOSTILE, 1) as show:
        show(1)
    console.help_console.print(HOSTILE, soft_wrap=True)
    out, err = capsys.readouterr()
    assert err == f"baldwinlab: {SHOWN}\n"
    assert out.startswith(f"{SHOWN}\n")
    assert out.endswith(f"{SHOWN}\n") and f"\n{SHOWN}: 100%" in out
    # A message, a heading, a cell, a styled text, the progress and the help. Others are wrapped.
    assert out.count("evil\\u2028\\udcff[bold][/x]:fire:") == 6
    assert not set(out) & set("\x1b\x07\r\x9b\u202e\u2028\udcff")


def test_json_and_toml_have_the_same_values_with_visible_controls(
    capsys: pytest.CaptureFixture[str],
) -> None:
    console.print_json({"name": HOSTILE})
    out = capsys.readouterr().out
    assert json.loads(out) == {"name": HOSTILE}
    assert "\x1b" not in out and "\u202e" not in out
    console.write_output('name = "\u202e\u2028"')
    out = capsys.readouterr().out
    assert out == 'name = "\\u202e\\u2028"'
    assert tomllib.loads(out) == {"name": "\u202e\u2028"}


def test_a_log_has_progress_lines_also_if_colors_are_forced(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(console.console, "_force_terminal", True)
    assert console.console.is_terminal
    with console.progress("simulating", 1) as show:
        show(1)
    out = capsys.readouterr().out
    assert out.startswith("simulating: 100%") and "\x1b" not in out
