"""Makes the pictures of the lab in docs/ anew: `python -m scripts.pictures results/paper`, of the study of `make reproduce`.

Those of papers are of the studies beside it, among which `baldwinlab reproduce nolfi-parisi-1993` must have left its own.
Needs the extra `lab`, playwright and a Chromium, as the browser tests do.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from playwright.sync_api import Browser, Page, expect

from benchmarks.lab import chromium, serving

PICTURES: Final = Path(__file__).parents[1] / "docs" / "pictures"
LIFE: Final = "condition=evo%2Bself-taught/B&generation=99&step=3200"
CELLS: Final = "study=nolfi-parisi-1993&condition=auto-teaching&generation=50&step=1180"
DESK, PHONE = (1280, 800), (390, 844)
WORLDS: Final = {  # what is opened, in which window
    "world": (LIFE, DESK),
    "guide": (f"{LIFE}&guide=open", DESK),
    "inside": (f"{LIFE}&agent=12", DESK),
    "ancestors": (f"{LIFE}&agent=12&inside=ancestors", DESK),
    "beside": (f"{LIFE}&b.condition=evo/B", DESK),
    "phone": (LIFE, PHONE),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path, help="the paper's study, as `make reproduce` leaves it")
    study = parser.parse_args().study
    of_papers(study.parent)
    with serving(study) as address, chromium() as browser:
        for name, (state, window) in WORLDS.items():
            page = opened(
                browser,
                f"{address}#/world?{state}",
                window,
                closed=() if name == "guide" else ("world",),
            )
            expect(page.locator("[data-ready]")).to_have_count(
                2 if name == "beside" else 1, timeout=60_000
            )
            keep(page, name)
        page = opened(browser, f"{address}#/results?study=.", (1280, 1000), closed=("results",))
        page.get_by_test_id("curves").locator("canvas").wait_for(timeout=120_000)
        keep(page, "results")
        page = opened(
            browser, f"{address}#/live?preset=evo%2Bself-taught/B&pace=0", DESK, closed=("live",)
        )
        page.get_by_test_id("start").click()
        expect(page.get_by_test_id("live-caption")).to_contain_text("Generation 9", timeout=120_000)
        keep(page, "live")


def of_papers(folder: Path) -> None:
    """Their cards, and a life of one of them."""
    with serving(folder) as address, chromium() as browser:
        page = opened(browser, f"{address}#/papers", (1280, 1000), closed=("papers",))
        page.locator(".paper-card").first.wait_for()
        keep(page, "papers")
        page = opened(browser, f"{address}#/world?{CELLS}", DESK, closed=("world",))
        expect(page.locator("[data-ready]")).to_have_count(1)
        keep(page, "cells")


def opened(
    browser: Browser, address: str, window: tuple[int, int], closed: tuple[str, ...]
) -> Page:
    """A page of a reader who has closed the words about these views."""
    page = browser.new_page(
        viewport={"width": window[0], "height": window[1]}, color_scheme="light"
    )
    for view in closed:
        page.add_init_script(f"localStorage.setItem('baldwinlab.closed-guide.{view}', '')")
    page.goto(address)
    return page


def keep(page: Page, name: str) -> None:
    page.wait_for_timeout(1500)  # until all is drawn
    page.screenshot(path=PICTURES / f"lab-{name}.png")
    page.close()


if __name__ == "__main__":
    main()
