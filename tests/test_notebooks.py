"""Run the notebooks and compare their outputs with their texts."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

import jupytext
import pytest
from playwright.sync_api import Browser

from scripts.notebooks import NOTEBOOKS, executed, page, paths
from tests.lab.client import open_offline_page

# Half a minute each.
PLAYER = "<iframe sandbox"
CURVES = "data:image/svg+xml"
# Displays and numbers that the outputs must contain, because the texts mention them.
EXPECTED_OUTPUTS: Final = {
    "reading-a-study": (PLAYER, CURVES, "image/png", r"evo/B +(0\.0 +){6}0\.0"),
    "baldwin-effect": (
        "all fields are at their defaults",
        PLAYER,
        CURVES,
        "image/png",
        "a life of guessing: 0.62",
        r"50 +0\.76 +0\.24 +0\.00 +1\.00",
        r"evo\+self-taught/A +76\.1 +235\.2 +224\.6 +319\.4 +20\.9",
        r"evo/B +(0\.0 *){5}\n",
        r"first generation and in the last: \[0\.41 0\.02\]",
        r"evo\+random-targets/A +246\.3 +182\.8 +175\.1 +309\.7 +186\.7",
    ),
}


def test_every_notebook_has_expected_outputs_and_a_line_in_the_list() -> None:
    assert {path.stem for path in paths()} == set(EXPECTED_OUTPUTS)
    listed = re.findall(r"\]\(([\w-]+)\.md\)", (NOTEBOOKS / "README.md").read_text("utf-8"))
    assert sorted(listed) == sorted(EXPECTED_OUTPUTS)


@pytest.mark.parametrize("path", paths(), ids=lambda path: path.stem)
def test_jupytext_writes_a_notebook_as_it_is_stored(path: Path) -> None:
    """Opening and saving a notebook in Jupyter changes only the version of jupytext."""
    text = path.read_text("utf-8")
    written = jupytext.writes(jupytext.reads(text, fmt="md"), fmt="md")
    assert re.sub(r" +(format|jupytext)_version: .+\n", "", written) == text


# Each notebook takes ten seconds or more.
@pytest.mark.nightly
@pytest.mark.parametrize("path", paths(), ids=lambda path: path.stem)
def test_a_notebook_runs_without_a_warning_and_shows_what_its_text_mentions(
    path: Path, tmp_path: Path, browser: Browser, capfd: pytest.CaptureFixture[str]
) -> None:
    notebook = executed(path, tmp_path)
    assert "WARNING" not in capfd.readouterr().err
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    assert [output["text"] for output in outputs if output.get("name") == "stderr"] == []
    text = "\n".join(_text(output) for output in outputs)
    for expected in EXPECTED_OUTPUTS[path.stem]:
        assert re.search(expected, text) or expected in text, expected
    assert "does not hold" not in text
    _check_page(browser, tmp_path / "page.html", page(notebook))


def _text(output: Any) -> str:
    """Return the text and the types of one output of a cell."""
    return "\n".join(
        ["".join(output.get("text", ""))]
        + [f"{kind}\n{value}" for kind, value in output.get("data", {}).items()]
    )


def _check_page(browser: Browser, path: Path, content: str) -> None:
    """Check that a page requests nothing, fits a phone and shows its players."""
    path.write_text(content, "utf-8")
    with open_offline_page(browser, 844) as (browser_page, requests):
        browser_page.set_viewport_size({"width": 390, "height": 844})
        browser_page.goto(path.as_uri())
        players = browser_page.locator("iframe")
        for number in range(players.count()):
            players.nth(number).scroll_into_view_if_needed()
            player = browser_page.frame_locator("iframe").nth(number)
            player.get_by_test_id("timeline").wait_for()
        assert browser_page.evaluate("document.documentElement.scrollWidth") <= 390
    assert [url for url in requests if not url.startswith(("data:", "file:", "about:"))] == []
