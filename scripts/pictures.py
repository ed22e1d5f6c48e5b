"""Make the pictures of the lab in docs/: `python -m scripts.pictures results/paper`.

The argument is the study of `make reproduce`. Its folder must also contain the study of
`baldwinlab reproduce nolfi-parisi-1993`. The script needs the extra `lab`, playwright and Chromium.
"""

from __future__ import annotations

import argparse
import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import uvicorn
from playwright.sync_api import Browser, Page, expect, sync_playwright

from baldwinlab.lab.server.access import Access
from baldwinlab.lab.server.app import make_app

PICTURES: Final = Path(__file__).parents[1] / "docs" / "pictures"
LIFE: Final = "condition=evo%2Bself-taught/B&generation=99&step=3200"
CELLS: Final = "study=nolfi-parisi-1993&condition=auto-teaching&generation=50&step=1180"
DESK = (1280, 800)
PHONE = (390, 844)
# State and window of each picture.
WORLDS: Final = {
    "world": (LIFE, DESK),
    "inside": (f"{LIFE}&agent=12", DESK),
    "ancestors": (f"{LIFE}&agent=12&inside=ancestors", DESK),
    "beside": (f"{LIFE}&b.condition=evo/B", DESK),
    "phone": (LIFE, PHONE),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path, help="the study of `make reproduce`")
    study = parser.parse_args().study
    capture_papers(study.parent)
    with serving(study) as address, chromium() as browser:
        for name, (state, window) in WORLDS.items():
            page = open_page(browser, f"{address}#/world?{state}", window)
            expect(page.locator("[data-ready]")).to_have_count(
                2 if name == "beside" else 1, timeout=60_000
            )
            save_picture(page, name)
        page = open_page(browser, f"{address}#/results?study=.", (1280, 1000))
        page.get_by_test_id("curves").locator("canvas").first.wait_for(timeout=120_000)
        save_picture(page, "results")
        page = open_page(browser, f"{address}#/live?preset=evo%2Bself-taught/B&pace=0", DESK)
        page.get_by_test_id("start").click()
        expect(page.get_by_test_id("live-caption")).to_contain_text("Generation 9", timeout=120_000)
        save_picture(page, "live")


def capture_papers(folder: Path) -> None:
    """Capture the cards of papers, and a lifetime of one paper."""
    with serving(folder) as address, chromium() as browser:
        page = open_page(browser, f"{address}#/papers", (1280, 1000))
        page.locator(".paper-card").first.wait_for()
        save_picture(page, "papers")
        page = open_page(browser, f"{address}#/world?{CELLS}", DESK)
        expect(page.locator("[data-ready]")).to_have_count(1)
        save_picture(page, "cells")


@contextmanager
def serving(root: Path) -> Iterator[str]:
    """Serve the studies of a folder, and yield the address with the token."""
    access = Access()
    app = make_app(root, access)
    server = uvicorn.Server(uvicorn.Config(app, host="127.0.0.1", port=0, log_level="error"))
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        while not server.started:
            time.sleep(0.01)
        port = server.servers[0].sockets[0].getsockname()[1]
        yield f"http://127.0.0.1:{port}/?token={access.token}"
    finally:
        server.should_exit = True
        thread.join()


@contextmanager
def chromium() -> Iterator[Browser]:
    """Start a browser that `make browser` installs."""
    names = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
    path = next(filter(None, map(shutil.which, names)), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


def open_page(browser: Browser, address: str, window: tuple[int, int]) -> Page:
    """Open a page in a window of this size."""
    page = browser.new_page(
        viewport={"width": window[0], "height": window[1]}, color_scheme="light"
    )
    page.goto(address)
    return page


def save_picture(page: Page, name: str) -> None:
    # The page needs time to draw.
    page.wait_for_timeout(1500)
    page.screenshot(path=PICTURES / f"lab-{name}.png")
    page.close()


if __name__ == "__main__":
    main()
