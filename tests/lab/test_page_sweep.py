"""Tests of sweeps from the Live tab: the dialog, the progress and the results."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from urllib.parse import urlencode

from playwright.sync_api import Page, expect

from tests.axe import find_violations
from tests.lab.client import LabServer

CHANGES = {"lifetime.steps": 200, "evolution.generations": 2, "world.start.x": 400}


def test_a_sweep_is_planned_downloaded_started_and_opened_in_results(
    page: Page, lab_server: LabServer
) -> None:
    query = {"preset": "evo+self-taught/A", "runs": 2, "set": json.dumps(CHANGES)}
    page.goto(f"/#/live?{urlencode(query)}")
    page.get_by_test_id("sweep").click()
    field = page.get_by_test_id("sweep-field-0")
    values = page.get_by_test_id("sweep-values-0")
    start = page.get_by_test_id("sweep-start")
    size = page.get_by_test_id("sweep-size")
    expect(start).to_be_disabled()
    # The values of a choice are ticks.
    field.select_option("learning.rule")
    page.get_by_test_id("sweep-ticks-0").get_by_label("hebb", exact=True).check()
    expect(page).to_have_url(re.compile(r"fields=.*self-taught.*hebb"))
    field.select_option("learning.rate")
    expect(values).to_have_value("0.005, 0.01, 0.02")
    expect(size).to_contain_text("3 points, 6 runs in total: ", timeout=60_000)
    values.fill("0.01, 11")
    expect(page.get_by_test_id("sweep-fault")).to_contain_text("learning.rate = 11")
    expect(start).to_be_disabled()
    values.fill("0.01, 0.1")
    expect(size).to_contain_text("2 points, 4 runs in total: ")
    expect(size).to_contain_text(
        "With 2 runs and 2 tests, the smallest corrected p-value is 0.67."
        " At least 5 runs are needed. Set the number of runs to 5."
    )
    expect(page).to_have_url(re.compile(r"fields=.*learning\.rate.*0\.01,0\.1"))
    # The address contains the plan.
    page.reload()
    expect(values).to_have_value("0.01, 0.1")
    expect(start).to_be_enabled(timeout=60_000)
    assert find_violations(page) == []
    with page.expect_download() as download:
        page.get_by_test_id("download-sweep.toml").click()
    plan = tomllib.loads(download.value.path().read_text())
    assert plan["fields"] == {"learning.rate": [0.01, 0.1]}
    page.get_by_test_id("sweep-name").fill("swept/rates")
    start.click()
    expect(page.get_by_test_id("sweep-dialog")).to_have_count(0)
    expect(page.get_by_test_id("sweep-state")).to_have_text("Done", timeout=60_000)
    expect(page.get_by_test_id("sweep-count")).to_have_text("4 of 4 runs")
    expect(page).to_have_url(re.compile(r"sweep=swept/rates$"))
    assert find_violations(page) == []
    page.get_by_test_id("sweep-results").click()
    expect(page.get_by_test_id("curves").locator(".chart-key")).to_have_text(["0.01", "0.1"])
    page.goto("/#/results?study=swept/rates")
    expect(page.get_by_test_id("curves").locator(".chart-key")).to_have_text(["0.01", "0.1"])
    page.goto("/#/live?sweep=swept/gone")
    expect(page.get_by_test_id("live-empty")).to_contain_text("This sweep has ended")
    expect(page.get_by_role("link", name="swept/rates, 4 of 4 runs, done")).to_be_visible()
    shutil.rmtree(lab_server.root / "swept")


def test_escape_closes_the_dialog_and_removes_the_plan(page: Page) -> None:
    page.goto("/#/live")
    page.get_by_test_id("sweep").click()
    page.get_by_test_id("sweep-field-0").select_option("population.size")
    expect(page).to_have_url(re.compile("fields="))
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("sweep-dialog")).to_have_count(0)
    expect(page.get_by_test_id("sweep")).to_be_focused()
    expect(page).not_to_have_url(re.compile("fields="))
