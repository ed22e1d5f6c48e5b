"""Text of the lab and of the essay: no text is too small, and all of it has the bundled font."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlencode

import pytest
from playwright.sync_api import Browser, Page

from baldwinlab.analysis.typeface import FAMILY, MIN_PIXELS
from tests.lab.client import SMALL
from tests.lab.essays import open_essay
from tests.text_sizes import find_small_texts, has_bundled_font

LIFE = urlencode(SMALL)
# A tab, and an element that appears when the tab is complete.
TABS = {
    f"world?{LIFE}&step=120&guide=open": "[data-ready]",
    "live": '[data-testid="start"]',
    "results?study=small": '[data-testid="curves"] canvas',
    "papers": '[data-testid^="paper-"]',
}
# Stores the font of each text that is drawn on a canvas, and its size in CSS pixels.
RECORD_FONTS = """
const draw = CanvasRenderingContext2D.prototype.fillText;
globalThis.drawnFonts = [];
CanvasRenderingContext2D.prototype.fillText = function (...values) {
  const { a, b } = this.getTransform();
  const size = Number.parseFloat(/([\\d.]+)px/.exec(this.font)[1]) * Math.hypot(a, b);
  drawnFonts.push({ size: size / devicePixelRatio, font: this.font });
  return draw.apply(this, values);
};
"""


def list_wrong_fonts(page: Page) -> list[str]:
    """Return the fonts of canvases that are too small, or of another family."""
    return [
        f"{drawn['size']:.1f} px: {drawn['font']}"
        for drawn in page.evaluate("drawnFonts")
        if drawn["size"] < MIN_PIXELS - 0.05 or FAMILY not in drawn["font"]
    ]


@pytest.mark.parametrize("tab", TABS)
def test_no_text_of_a_tab_is_too_small(page: Page, tab: str) -> None:
    page.add_init_script(RECORD_FONTS)
    page.goto(f"/#/{tab}")
    page.locator(TABS[tab]).first.wait_for()
    assert find_small_texts(page) == []
    assert list_wrong_fonts(page) == []
    assert has_bundled_font(page)


@pytest.mark.parametrize("width", [1280, 390])
def test_no_text_of_the_essay_is_too_small(browser: Browser, essay: Path, width: int) -> None:
    # With reduced motion, the essay draws all pictures at once.
    with open_essay(browser, essay, width, reduced_motion="reduce", script=RECORD_FONTS) as page:
        page.locator("footer").scroll_into_view_if_needed()
        assert find_small_texts(page) == []
        assert list_wrong_fonts(page) == []
        assert has_bundled_font(page)
