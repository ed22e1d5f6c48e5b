"""Tests with axe-core: tabs and shared pages have no barriers, in both color schemes."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from playwright.sync_api import Page, expect

from baldwinlab.studies.status import write_claims
from baldwinlab.studies.store import StudyStore
from tests.axe import find_violations
from tests.lab.client import SMALL, LabServer, get_response
from tests.lab.conftest import run_server
from tests.lab.test_page_results import CLAIM

LIFE = urlencode(SMALL)


def test_the_world_tab_has_no_barriers_with_guide_comparison_and_agent(
    themed_page: Page,
) -> None:
    themed_page.goto(f"/#/world?{LIFE}&step=120&guide=open")
    expect(themed_page.get_by_test_id("guide")).to_contain_text("Filled agents have eaten")
    assert find_violations(themed_page) == []
    themed_page.get_by_test_id("agent-3").click()
    expect(themed_page.get_by_test_id("relatives")).to_contain_text("parents")
    themed_page.get_by_test_id("compare").click()
    expect(themed_page.locator("[data-ready]")).to_have_count(2)
    assert find_violations(themed_page) == []
    themed_page.get_by_test_id("ancestors-of").click()
    expect(themed_page.get_by_test_id("ancestor").first).to_be_visible()
    assert find_violations(themed_page) == []
    themed_page.get_by_test_id("share").click()
    expect(themed_page.get_by_test_id("share-link")).to_be_visible()
    assert find_violations(themed_page) == []
    themed_page.keyboard.press("Escape")
    themed_page.get_by_test_id("keys").click()
    assert find_violations(themed_page) == []


def test_the_world_tab_of_a_model_without_a_world_has_no_barriers(
    themed_page: Page, strings_server: LabServer
) -> None:
    query = "study=strings&condition=guessing&run=1&generation=3&guide=open"
    themed_page.goto(f"{strings_server.entry}#/world?{query}")
    expect(themed_page.get_by_test_id("alleles")).to_be_visible()
    expect(themed_page.get_by_test_id("guide")).to_contain_text("Each bar is one locus")
    assert find_violations(themed_page) == []


def test_the_live_tab_has_no_barriers_before_and_after_a_run(themed_page: Page) -> None:
    changes = '{"lifetime.steps":300,"evolution.generations":2}'
    query = {"preset": "evo+self-taught/A", "runs": 2, "pace": 0, "set": changes}
    themed_page.goto(f"/#/live?{urlencode(query)}")
    expect(themed_page.get_by_test_id("start")).to_be_enabled()
    themed_page.get_by_test_id("group-learning").locator("summary").click()
    themed_page.get_by_test_id("field-learning.rate").fill("11")
    expect(themed_page.get_by_test_id("main-settings")).to_contain_text(
        "should be less than or equal to 10"
    )
    assert find_violations(themed_page) == []
    themed_page.get_by_test_id("field-learning.rate").fill("0.01")
    expect(themed_page.get_by_test_id("start")).to_be_enabled()
    themed_page.get_by_test_id("start").click()
    expect(themed_page.get_by_test_id("live-state")).to_have_text("Done")
    assert find_violations(themed_page) == []
    themed_page.get_by_test_id("save").click()
    assert find_violations(themed_page) == []


def test_the_results_tab_has_no_barriers_with_all_verdicts(
    themed_page: Page, lab_server: LabServer
) -> None:
    verdicts = ("holds", "undecided", "does not hold", "not evaluated")
    write_claims(
        StudyStore(lab_server.root / "small"),
        [CLAIM | {"id": verdict, "verdict": verdict} for verdict in verdicts],
    )
    themed_page.goto("/#/results?study=small")
    themed_page.get_by_test_id("curves").locator("canvas").first.wait_for()
    themed_page.get_by_test_id("curves").get_by_role("button", name="evo/A").click()
    for section in ("comparison", "factors", "finals", "runs", "claims", "save-fitness"):
        themed_page.get_by_test_id(section).locator("summary").first.click()
    themed_page.get_by_test_id("sort-best").click()
    expect(themed_page.get_by_test_id("runs").locator("tbody tr")).to_have_count(4)
    assert find_violations(themed_page) == []
    (lab_server.root / "small" / "claims.json").unlink()
    themed_page.goto("/#/results?study=gone")
    expect(themed_page.get_by_test_id("results-empty")).to_be_visible()
    assert find_violations(themed_page) == []


def test_the_page_during_the_start_has_no_barriers(themed_page: Page, tmp_path: Path) -> None:
    with run_server(tmp_path, lambda: False) as server:
        themed_page.goto(server.entry)
        expect(themed_page.get_by_text("The lab is starting")).to_be_visible()
        assert find_violations(themed_page) == []
        themed_page.goto("about:blank")


def test_a_shared_page_has_no_barriers(
    themed_page: Page, lab_server: LabServer, tmp_path: Path
) -> None:
    query: dict[str, Any] = {"a": LIFE, "b": urlencode(SMALL | {"condition": "evo/A"}), "step": 40}
    path = tmp_path / "shared.html"
    path.write_bytes(get_response(lab_server.address, "share", **query).content)
    themed_page.goto(path.as_uri())
    expect(themed_page.get_by_test_id("replay-step")).to_have_text("40 / 299")
    themed_page.locator("summary").first.click()
    assert find_violations(themed_page) == []
