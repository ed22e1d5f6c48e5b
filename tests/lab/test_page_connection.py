"""Tests of a page whose server is suspended or starts again, and of runs without a page."""

from __future__ import annotations

import re
import signal
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from baldwinlab.cli.lab import open_listener
from baldwinlab.lab.server.access import Access
from tests.cli.test_lab import start_lab
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study

LIVE = "preset=evo/A&runs=1&pace=0.5&set=%7B%22lifetime.steps%22:100%7D"


@pytest.mark.skipif(sys.platform == "win32", reason="the platform has no SIGSTOP")
def test_a_server_that_does_not_answer_is_reported_until_it_answers(
    browser: Browser, tmp_path: Path
) -> None:
    with start_lab(tmp_path) as (process, server), server.open_page(browser) as page:
        page.goto(f"{server.entry}#/papers")
        banner = page.get_by_test_id("connection")
        expect(banner).to_be_hidden()
        process.send_signal(signal.SIGSTOP)
        try:
            expect(banner).to_have_text(re.compile("The lab has not answered for 3 seconds"))
        finally:
            process.send_signal(signal.SIGCONT)
        expect(banner).to_be_hidden()


def test_a_run_survives_its_page_and_an_open_page_survives_a_restart(
    browser: Browser, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "small", runs=1)
    access = Access()
    # The port stays in use between the two servers.
    with open_listener(0) as listener, ExitStack() as first:
        start = partial(run_server, tmp_path, access=access)
        server = first.enter_context(start(listener=listener.dup()))
        with server.context(browser) as context:
            page = context.new_page()
            page.goto(f"{server.entry}#/live?{LIVE}")
            expect(page.get_by_test_id("field-lifetime.steps")).to_have_value("100", timeout=60_000)
            page.get_by_test_id("start").click()
            expect(page.get_by_test_id("live-state")).to_have_text("Running", timeout=60_000)
            run = page.url.split("id=")[1].split("&")[0]
            page.close()
            page = context.new_page()
            page.goto(f"{server.address}/#/live")
            page.get_by_test_id("live-more").locator("summary").click()
            page.get_by_test_id("runs-open").click()
            entry = page.get_by_test_id(f"run-{run}")
            expect(entry).to_contain_text("running")
            entry.get_by_role("button", name="Stop").click()
            expect(entry).to_contain_text("stopped")
            entry.get_by_role("link").click()
            expect(page.get_by_test_id("live-state")).to_have_text("Stopped")
            page.get_by_test_id("live-more").locator("summary").click()
            page.get_by_test_id("runs-open").click()
            page.get_by_test_id(f"run-{run}").get_by_role("button", name="Remove").click()
            expect(page.get_by_test_id(f"run-{run}")).to_have_count(0)
            page.keyboard.press("Escape")
            first.close()
            expect(page.get_by_test_id("connection")).to_be_visible()
            with start(listener=listener.dup()):
                expect(page.get_by_test_id("connection")).to_be_hidden()
                page.get_by_test_id("tab-results").click()
                expect(page.get_by_test_id("curves")).to_be_visible()
