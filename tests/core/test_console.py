"""Progress is a bar in a terminal and in a notebook, and a plain line otherwise."""

from __future__ import annotations

import sys
from types import ModuleType

import pytest

from baldwinlab.core import console


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
