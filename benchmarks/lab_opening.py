"""Measure the seconds from opening the lab to the first meal: `python -m benchmarks.lab_opening`.

The first page opens when the command has printed the address. With `--new-machine`, the engine is
not compiled. Later pages open when the engine is ready.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import Browser

from benchmarks.lab import chromium

N_PAGES = 3
POLL_SECONDS = 0.05
# Return whether a count of eaten items on the page is above 0.
HAS_MEAL = """() => [...document.querySelectorAll("[data-testid^=eaten-]")]
    .some(({ textContent }) => /(^|\\D)[1-9]\\d* eaten/.test(textContent))"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder with studies")
    parser.add_argument("--new-machine", action="store_true", help="compile the engine")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as cache, chromium() as browser:
        environment = {"XDG_CACHE_HOME": cache} if options.new_machine else {}
        server = subprocess.Popen(
            [sys.executable, "-m", "baldwinlab", "lab", options.folder, "--port=0", "--no-browser"],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | environment,
        )
        assert server.stdout is not None
        match = re.search(r"http://\S+", server.stdout.readline())
        assert match
        try:
            for number in range(N_PAGES):
                print(f"page {number}: {measure_first_meal(browser, match.group()):.1f} s")
        finally:
            server.terminate()
            server.wait()


def measure_first_meal(browser: Browser, address: str) -> float:
    """Return the seconds from opening a page to the first eaten item."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    start_time = time.monotonic()
    page.goto(address)
    while not page.evaluate(HAS_MEAL):
        time.sleep(POLL_SECONDS)
    seconds = time.monotonic() - start_time
    page.close()
    return seconds


if __name__ == "__main__":
    main()
