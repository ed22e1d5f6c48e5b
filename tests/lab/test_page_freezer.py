"""Tests of the freezer in the page: keep agents, use them as founders, let them compete."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect

import baldwinlab as bl
from tests.axe import find_violations
from tests.lab.client import LabServer

LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"


@pytest.fixture
def page(browser: Browser, freezer: LabServer) -> Iterator[Page]:
    with freezer.open_page(browser, viewport={"width": 1280, "height": 800}) as page:
        yield page


def read_changes(page: Page) -> dict[str, Any]:
    """Return the changed settings in the address."""
    expect(page).to_have_url(re.compile("[?&]set="))
    query = parse_qs(urlsplit(page.url).fragment.partition("?")[2])
    changes: dict[str, Any] = json.loads(query["set"][0])
    return changes


def store(page: Page, test_id: str, name: str) -> None:
    """Store agents by an entry of the share menu."""
    page.get_by_test_id("share").click()
    page.get_by_test_id(test_id).click()
    page.get_by_test_id("save-name").fill(name)
    page.get_by_test_id("save-submit").click()


def test_agents_and_populations_are_kept_from_the_world_and_from_a_live_run(
    page: Page, freezer: LabServer
) -> None:
    page.goto(f"/#/world?{LIFE}&agent=4")
    expect(page.get_by_test_id("relatives")).to_contain_text("parents")
    store(page, "keep-agent", "agent")
    store(page, "keep-a", "population")
    expect(page.get_by_test_id("message-done")).to_have_count(2)
    store(page, "keep-a", "population")
    expect(page.get_by_test_id("save-fault")).to_contain_text("exists already")
    page.keyboard.press("Escape")
    # Of two worlds, both populations can be kept.
    page.get_by_test_id("close-agent").click()
    page.get_by_test_id("compare").click()
    expect(page.locator("[data-ready]")).to_have_count(2)
    store(page, "keep-b", "second-population")
    expect(page.get_by_test_id("message-done").last).to_contain_text("second-population.nc")
    changes = json.dumps({"evolution.generations": 2, "lifetime.steps": 50})
    page.goto(f"/#/live?runs=1&pace=0&set={changes}")
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    store(page, "keep-a", "live-population")
    expect(page.get_by_test_id("message-done").last).to_contain_text("live-population.nc")
    sizes = {"agent": 1, "population": 20, "second-population": 20, "live-population": 20}
    for name, n_agents in sizes.items():
        trace = bl.replay(genome=freezer.root / "freezer" / f"{name}.nc")
        assert trace.sizes["agent"] == n_agents


def test_stored_agents_become_the_founders_of_a_run_in_another_condition(page: Page) -> None:
    page.goto("/#/live?runs=1")
    page.get_by_test_id("live-more").locator("summary").click()
    page.get_by_test_id("freezer").click()
    entry = page.get_by_test_id("frozen-file").filter(has_text="generation-2.nc")
    expect(entry).to_contain_text("evo+self-taught/A, generation 2, run 0, 20 agents")
    assert find_violations(page) == []
    entry.get_by_test_id("freezer-condition").select_option("evo+self-taught/B")
    entry.get_by_test_id("use-founders").click()
    expect(page.get_by_test_id("preset")).to_have_value("evo+self-taught/B")
    (founders,) = read_changes(page)["evolution.founders"]
    assert founders["path"].endswith("generation-2.nc")
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("live-canvas-count")).to_contain_text("of 20 ate")


def test_two_files_compete(page: Page) -> None:
    page.goto("/#/live")
    page.get_by_test_id("live-more").locator("summary").click()
    page.get_by_test_id("freezer").click()
    page.get_by_test_id("compete-a").select_option("generation-0.nc")
    page.get_by_test_id("compete-b").select_option("generation-0.nc")
    page.get_by_test_id("setup-lives").fill("3")
    page.get_by_test_id("compete").click()
    # A file against itself.
    expect(page.get_by_test_id("competition")).to_contain_text(
        "Undecided: difference 0, 95 % interval 0 to 0, 3 lives."
    )


def test_founders_have_equal_shares_in_the_form(page: Page) -> None:
    page.goto("/#/live")
    page.get_by_test_id("group-evolution").locator("summary").first.click()
    for _ in range(2):
        page.get_by_test_id("add-founders").click()
    expect(page.get_by_test_id("share-1")).to_have_value("0.5")
    page.get_by_role("button", name="Remove founders 2").click()
    expect(page.get_by_test_id("share-0")).to_have_value("1")
    expect(page.get_by_test_id("start")).to_be_enabled()


def test_a_schedule_is_a_list_that_the_server_checks(page: Page) -> None:
    page.goto("/#/live")
    schedule = page.get_by_test_id("schedule")
    schedule.fill('[{"generation": 5')
    expect(page.get_by_test_id("setup-fault")).to_contain_text("schedule")
    expect(page.get_by_test_id("start")).to_be_disabled()
    schedule.fill('[{"generation": 5, "population.size": 7}]')
    expect(page.get_by_test_id("setup-fault")).to_contain_text("population.size")
    expected = [{"generation": 5, "learning.rule": "none"}]
    schedule.fill(json.dumps(expected))
    expect(page.get_by_test_id("start")).to_be_enabled()
    expect(page).to_have_url(re.compile("learning.rule"))
    assert read_changes(page)["schedule"] == expected
    # A link restores the list.
    page.reload()
    expect(schedule).to_have_value(re.compile('"generation": 5,'))
