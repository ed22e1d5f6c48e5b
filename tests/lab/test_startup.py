"""Tests of the startup: the page plays a packaged lifetime while the engine is compiled."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path
from threading import Event

import pytest
from playwright.sync_api import Browser, expect

from tests.lab.client import get_json
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study


def test_the_packaged_lifetimes_are_current() -> None:
    script = runpy.run_path(str(Path(__file__).parents[2] / "scripts/first_life.py"))
    contents = script["record_lives"]()
    for path, content in contents.items():
        assert path.read_bytes() == content, "run `python scripts/first_life.py`"
    assert sum(map(len, contents.values())) < 350_000


def test_the_server_does_not_import_the_libraries_of_reports() -> None:
    code = "import baldwinlab.lab.server, sys; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"scipy.stats", "matplotlib"} & set(loaded)


@pytest.mark.parametrize("view", ["world", "live"])
def test_the_page_shows_the_packaged_lifetime_until_the_engine_is_ready(
    browser: Browser, tmp_path: Path, view: str
) -> None:
    make_small_study(tmp_path / "small", runs=1)
    compiled = Event()
    with run_server(tmp_path, compiled.is_set) as server:
        page = server.context(browser, viewport={"width": 390, "height": 844}).new_page()
        page.goto(f"/#/{view}")
        first = page.get_by_test_id("first-life")
        expect(first).to_contain_text("The lab prepares its engine.")
        expect(first).to_contain_text(re.compile(r"Elapsed: [1-9]\d* s"))
        # Learners and controls are both in sight.
        for name in "ab":
            expect(page.get_by_test_id(f"first-{name}-count")).to_contain_text("of 20 ate")
            expect(page.get_by_test_id(f"first-{name}")).to_be_in_viewport(ratio=0.9)
        # The lifetime plays without a click.
        expect(page.get_by_test_id("first-play")).to_have_attribute("aria-label", "Pause")
        # Results need no engine.
        page.get_by_test_id("tab-results").click()
        expect(page.get_by_test_id("results")).to_be_visible()
        page.get_by_test_id(f"tab-{view}").click()
        expect(first).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        assert not get_json(server.address, "engine")["ready"]
        compiled.set()
        expect(page.get_by_test_id("world-a" if view == "world" else "live-empty")).to_be_visible()
        expect(first).to_have_count(0)
        page.close()


def test_with_reduced_motion_the_lifetime_starts_with_a_click(
    browser: Browser, tmp_path: Path
) -> None:
    with run_server(tmp_path, lambda: False) as server:
        page = server.context(browser, reduced_motion="reduce").new_page()
        page.goto("/")
        expect(page.get_by_test_id("first-step")).to_have_text(re.compile(r"step \d+ of 600"))
        expect(page.get_by_test_id("first-play")).to_have_attribute("aria-label", "Play")
        page.close()
