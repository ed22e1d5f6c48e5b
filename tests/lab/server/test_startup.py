"""Tests of the startup: views that simulate wait for the engine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from threading import Event

import pytest
from playwright.sync_api import Browser, expect

from tests.lab.client import get_json
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study


def test_the_server_does_not_import_the_libraries_of_reports() -> None:
    code = "import baldwinlab.lab.server.app, sys; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"scipy.stats", "matplotlib"} & set(loaded)


@pytest.mark.parametrize("view", ["world", "live"])
def test_a_view_that_simulates_waits_for_the_engine(
    browser: Browser, tmp_path: Path, view: str
) -> None:
    make_small_study(tmp_path / "small", runs=1)
    compiled = Event()
    with run_server(tmp_path, compiled.is_set) as server:
        page = server.context(browser, viewport={"width": 390, "height": 844}).new_page()
        page.goto(f"/#/{view}")
        line = page.get_by_text("The lab is starting")
        expect(line).to_be_visible()
        # Results need no engine.
        page.get_by_test_id("tab-results").click()
        expect(page.get_by_test_id("results")).to_be_visible()
        expect(line).to_have_count(0)
        page.get_by_test_id(f"tab-{view}").click()
        expect(line).to_be_visible()
        assert not get_json(server.address, "engine")["ready"]
        compiled.set()
        expect(page.get_by_test_id("world-a" if view == "world" else "live-empty")).to_be_visible()
        expect(line).to_have_count(0)
        page.close()
