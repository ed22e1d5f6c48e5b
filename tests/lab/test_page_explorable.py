"""Tests of the explorable in a browser: motion, dials, questions, window sizes, print, barriers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.lab.pages import explorable
from tests.axe import find_violations
from tests.lab.client import draw_frames, read_box
from tests.lab.essays import RECORDINGS, STRINGS, drag, open_essay, read_value, show

# Return the number of pixels of a canvas that differ from its first pixel.
COUNT_PIXELS = """canvas => {
  const { width, height } = canvas;
  const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
  const pixels = new Uint32Array(data.buffer);
  return pixels.filter(pixel => pixel !== pixels[0]).length;
}"""
READ_PICTURE = "canvas => canvas.toDataURL()"


@pytest.fixture
def page(essay_page: Page) -> Page:
    return essay_page


def test_an_agent_moves_and_eats_without_a_click(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay, 390, 844) as page:
        canvas = page.locator("#agent canvas")
        picture = canvas.evaluate(READ_PICTURE)
        page.wait_for_function(
            "picture => document.querySelector('#agent canvas').toDataURL() !== picture",
            arg=picture,
        )
        expect(page.locator('[data-value="ring_items"]')).not_to_have_text(re.compile("^[…0]$"))


def test_the_line_and_the_points_follow_the_dials(page: Page) -> None:
    section = show(page, "needle")
    line = section.locator("polyline")
    before = line.get_attribute("points")
    share = read_value(section, "theory")
    drag(section, "cost", 0)
    expect(line).not_to_have_attribute("points", before or "")
    assert read_value(section, "theory") > share
    period = section.get_by_role("slider", name=STRINGS["dials"]["period"])
    period.focus()
    page.keyboard.press("Home")
    expect(period).to_have_attribute("aria-valuetext", str(explorable.NEEDLE_PERIODS[0]))


def test_learning_on_and_off_start_equal_and_end_apart(page: Page) -> None:
    section = show(page, "learning")
    expect(section.locator('[data-value="on"]')).not_to_have_text("…")
    page.wait_for_function(
        """() => Number(document.querySelector('#learning [data-value="on"]').textContent) >
          100 + Number(document.querySelector('#learning [data-value="off"]').textContent)"""
    )


def test_a_question_gives_feedback(page: Page) -> None:
    question = page.get_by_role("group", name=STRINGS["steps"][0]["question"]["text"])
    feedback = question.get_by_role("status")
    options = STRINGS["steps"][0]["question"]["options"]
    question.get_by_label(options[0]).check()
    expect(feedback).to_have_text(STRINGS["steps"][0]["question"]["wrong"])
    page.keyboard.press("ArrowDown")
    expect(feedback).to_have_text(STRINGS["steps"][0]["question"]["right"])


def test_only_the_picture_in_sight_plays(page: Page) -> None:
    canvas = page.locator("#agent canvas")
    expect(page.locator("#agent .play")).to_have_text("Pause")
    show(page, "needle")
    draw_frames(page)
    picture = canvas.evaluate(READ_PICTURE)
    draw_frames(page)
    assert canvas.evaluate(READ_PICTURE) == picture


def test_reduced_motion_shows_still_pictures_with_a_play_button(
    browser: Browser, essay: Path
) -> None:
    with open_essay(browser, essay, reduced_motion="reduce") as page:
        canvas = page.locator("#agent canvas")
        expect(page.locator("#agent .play")).to_have_text("Play")
        expect(page.locator('#both [data-value="learning"]')).not_to_have_text("…")
        picture = canvas.evaluate(READ_PICTURE)
        draw_frames(page)
        assert canvas.evaluate(READ_PICTURE) == picture
        page.locator("#agent .play").click()
        page.wait_for_function(
            "picture => document.querySelector('#agent canvas').toDataURL() !== picture",
            arg=picture,
        )


def test_without_webassembly_the_page_shows_recorded_runs(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay, script="delete globalThis.WebAssembly") as page:
        expect(page.get_by_text(STRINGS["page"]["no_engine"])).to_be_visible()
        section = show(page, "both")
        expect(section.locator(".play")).to_have_text("Start again")
        expected = np.mean(
            [run[explorable.FORK_GENERATION - 1] for run in RECORDINGS["curves"]["learning"]]
        )
        assert read_value(section, "learning") == pytest.approx(expected, rel=0.01)
        expect(page.locator("#both input[type=range]").first).to_be_disabled()


def test_without_scripts_the_texts_are_readable(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay, java_script_enabled=False) as page:
        for step in STRINGS["steps"]:
            expect(page.get_by_text(step["notice"])).to_be_visible()


@pytest.mark.parametrize("width", [320, 390, 768, 1280, 1920, 3840])
def test_the_page_fits_its_window(browser: Browser, essay: Path, width: int) -> None:
    with open_essay(browser, essay, width, reduced_motion="reduce") as page:
        expect(page.locator('#both [data-value="learning"]')).not_to_have_text("…")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        canvas = read_box(page.locator("#agent canvas"))
        assert canvas["width"] >= 0.4 * min(width, 1920) - 30


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.nightly)])
def test_the_page_has_no_barriers(
    browser: Browser, essay: Path, scheme: Literal["light", "dark"]
) -> None:
    with open_essay(browser, essay, color_scheme=scheme, reduced_motion="reduce") as page:
        expect(page.locator('#both [data-value="learning"]')).not_to_have_text("…")
        page.locator("#yours summary").click()
        assert find_violations(page) == []


def test_the_printed_page_contains_the_pictures(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay) as page:
        assert page.pdf(format="A4").startswith(b"%PDF")
        for step in ("agent", "evolution", "learning", "both", "controls", "innate"):
            canvas = page.locator(f"#{step} canvas").first
            assert canvas.evaluate(COUNT_PIXELS) > 100, step
