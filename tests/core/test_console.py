"""How far a long piece of work is: a bar on a terminal and in a notebook, plain lines elsewhere."""

from __future__ import annotations

import sys
from types import ModuleType

import pytest

from baldwinlab.core import console


def test_without_a_terminal_the_end_is_a_plain_line(capsys: pytest.CaptureFixture[str]) -> None:
    with console.progress("living", 10) as show:
        show(4)
        show(6)
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith("living: 100%, ")
    assert line.endswith(" agent-steps/s, 0 s left")


def test_a_notebook_has_one_bar_that_fills(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[str] = []

    class Shown:
        def __init__(self, content: str, display_id: bool) -> None:
            assert display_id

        def update(self, content: str) -> None:
            drawn.append(content)

    notebook = ModuleType("IPython.display")
    notebook.HTML, notebook.display = str, Shown  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", notebook)
    monkeypatch.setattr(console.console, "is_jupyter", True)
    monkeypatch.setattr(console, "BAR_INTERVAL", 0)
    with console.progress("living <again>", 10) as show:
        show(5)
        show(5)
    half, whole = drawn
    assert half.startswith('<progress value="0.500"></progress> living &lt;again&gt;: 50%')
    assert whole.startswith('<progress value="1.000"></progress> living &lt;again&gt;: 100%')
