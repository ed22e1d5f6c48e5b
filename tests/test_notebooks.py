"""The notebooks run from top to bottom in a kernel of this environment, warn of nothing, and show what they are said to show."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

import jupytext
import pytest
from playwright.sync_api import Browser

from scripts.notebooks import NOTEBOOKS, executed, page, paths
from tests.lab.conftest import offline

LONG = ("baldwin-effect", "own-learning-rule")  # half a minute each
TABLE, PLAYER, CURVES = "differ from their defaults", "<iframe sandbox", "data:image/svg+xml"
SHOWN: Final = {  # what stands in the outputs: what is displayed, and numbers that the text tells
    "first-steps": (TABLE, PLAYER, CURVES, "last generation: 2539 items, eaten by 20 of 20 agents"),
    "reading-a-study": (PLAYER, CURVES, "image/png", r"evo/B +(0\.0 +){6}0\.0"),
    "own-learning-rule": (
        TABLE,
        CURVES,
        "ok: the oracle agrees",
        "p = 0.55",
        "between -99 and 307 items",
    ),
    "baldwin-effect": (
        *(
            "all fields are at their defaults",
            PLAYER,
            CURVES,
            "image/png",
            "a life of guessing: 0.62",
        ),
        r"50 +0\.76 +0\.24 +0\.00 +1\.00",
        r"evo\+self-taught/A +76\.1 +235\.2 +224\.6 +319\.4 +20\.9",
        r"evo/B +(0\.0 *){5}\n",
        r"first generation and in the last: \[0\.41 0\.02\]",
        r"evo\+random-targets/A +246\.3 +182\.8 +175\.1 +309\.7 +186\.7",
    ),
}


def test_every_notebook_has_its_facts_and_its_line_on_the_page_that_lists_them() -> None:
    assert {path.stem for path in paths()} == set(SHOWN)
    listed = re.findall(r"\]\(([\w-]+)\.md\)", (NOTEBOOKS / "README.md").read_text("utf-8"))
    assert sorted(listed) == sorted(SHOWN)


@pytest.mark.parametrize("path", paths(), ids=lambda path: path.stem)
def test_a_notebook_is_text_as_jupytext_would_write_it(path: Path) -> None:
    """So that to open and to save one in Jupyter changes nothing but which version of jupytext did so."""
    text = path.read_text("utf-8")
    written = jupytext.writes(jupytext.reads(text, fmt="md"), fmt="md")
    assert re.sub(r" +(format|jupytext)_version: .+\n", "", written) == text


@pytest.mark.parametrize("path", paths(), ids=lambda path: path.stem)
def test_links_of_a_notebook_lead_somewhere(path: Path) -> None:
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", path.read_text("utf-8")):
        assert (path.parent / target).exists(), target


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.nightly] * (path.stem in LONG))
        for path in paths()
    ],
)
def test_a_notebook_runs_without_a_warning_and_shows_what_it_tells(
    path: Path, tmp_path: Path, browser: Browser, capfd: pytest.CaptureFixture[str]
) -> None:
    notebook = executed(path, tmp_path)
    assert "WARNING" not in capfd.readouterr().err, "nor does its kernel"
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    assert [output["text"] for output in outputs if output.get("name") == "stderr"] == []
    given = "\n".join(_text(output) for output in outputs)
    for wanted in SHOWN[path.stem]:
        assert re.search(wanted, given) or wanted in given, wanted
    assert "does not hold" not in given
    _opens_alone(browser, tmp_path / "page.html", page(notebook))


def _text(output: Any) -> str:
    """All that a cell gave in one output, and of what types."""
    return "\n".join(
        ["".join(output.get("text", ""))]
        + [f"{kind}\n{value}" for kind, value in output.get("data", {}).items()]
    )


def _opens_alone(browser: Browser, path: Path, content: str) -> None:
    """A page that asks nobody, fits a phone, and whose players are there."""
    path.write_text(content, "utf-8")
    with offline(browser, 844) as (opened, asked):
        opened.set_viewport_size({"width": 390, "height": 844})
        opened.goto(path.as_uri())
        players = opened.locator("iframe")
        for place in range(players.count()):
            players.nth(place).scroll_into_view_if_needed()
            opened.frame_locator("iframe").nth(place).get_by_test_id("timeline").wait_for()
        assert opened.evaluate("document.documentElement.scrollWidth") <= 390
    assert [url for url in asked if not url.startswith(("data:", "file:", "about:"))] == []
