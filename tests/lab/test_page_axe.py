"""axe-core finds no barrier on any tab of the lab or on a shared page, in light and in dark."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal
from urllib.parse import urlencode

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.studies.claims_file import write_claims
from baldwinlab.studies.store import StudyStore
from tests.axe import find_violations
from tests.lab.client import SMALL, LabServer, get_response
from tests.lab.conftest import run_server
from tests.lab.test_page_results import CLAIM

LIFE = urlencode(SMALL)


@pytest.fixture(params=["light", "dark"])
def shaded(
    browser: Browser, lab_server: LabServer, request: pytest.FixtureRequest
) -> Iterator[Page]:
    """A page on light or on dark ground, as the reader's machine is."""
    scheme: Literal["light", "dark"] = request.param
    with lab_server.context(browser, color_scheme=scheme) as context:
        yield context.new_page()


def test_the_world_tab_has_none_with_its_words_in_comparison_and_with_an_agent_open(
    shaded: Page,
) -> None:
    shaded.goto(f"/#/world?{LIFE}&step=120&guide=open")
    expect(shaded.get_by_test_id("guide")).to_contain_text("What to look for")
    assert find_violations(shaded) == []
    shaded.get_by_test_id("agent-3").click()
    expect(shaded.get_by_test_id("kin")).to_contain_text("parents")
    shaded.get_by_test_id("compare").click()
    expect(shaded.locator("[data-ready]")).to_have_count(2)
    assert find_violations(shaded) == []
    shaded.get_by_test_id("ancestors-of").click()
    expect(shaded.get_by_test_id("ancestor").first).to_be_visible()
    assert find_violations(shaded) == []
    shaded.get_by_test_id("share").click()
    expect(shaded.get_by_test_id("share-link")).to_be_visible()
    assert find_violations(shaded) == []
    shaded.keyboard.press("Escape")
    shaded.get_by_test_id("keys").click()
    assert find_violations(shaded) == []


def test_the_world_tab_of_a_model_without_worlds_has_none(
    shaded: Page, strings_server: LabServer
) -> None:
    shaded.goto(
        f"{strings_server.entry}#/world?study=strings&condition=guessing&run=1&generation=3&guide=open"
    )
    expect(shaded.get_by_test_id("alleles")).to_be_visible()
    expect(shaded.get_by_test_id("guide")).to_contain_text("The bars")
    assert find_violations(shaded) == []


def test_the_live_tab_has_none_before_and_after_a_run(shaded: Page) -> None:
    changes = '{"lifetime.steps":300,"evolution.generations":2}'
    shaded.goto(
        f"/#/live?{urlencode({'preset': 'evo+self-taught/A', 'runs': 2, 'pace': 0, 'set': changes})}"
    )
    expect(shaded.get_by_test_id("start")).to_be_enabled()
    shaded.get_by_test_id("group-learning").locator("summary").click()
    shaded.get_by_test_id("field-learning.rate").fill("11")
    expect(shaded.get_by_test_id("group-learning")).to_contain_text(
        "should be less than or equal to 10"
    )
    assert find_violations(shaded) == []
    shaded.get_by_test_id("field-learning.rate").fill("0.01")
    expect(shaded.get_by_test_id("start")).to_be_enabled()
    shaded.get_by_test_id("start").click()
    expect(shaded.get_by_test_id("live-state")).to_have_text("Done", timeout=60_000)
    assert find_violations(shaded) == []
    shaded.get_by_test_id("keep").click()
    assert find_violations(shaded) == []


def test_the_results_tab_has_none_whatever_came_of_claims(
    shaded: Page, lab_server: LabServer
) -> None:
    verdicts = ("holds", "undecided", "does not hold", "not evaluated")
    write_claims(
        StudyStore(lab_server.root / "small"),
        [CLAIM | {"id": one, "verdict": one} for one in verdicts],
    )
    shaded.goto("/#/results?study=small")
    shaded.get_by_test_id("curves").locator("canvas").wait_for()
    shaded.get_by_test_id("curves").get_by_role("button", name="evo/A").click()
    shaded.get_by_test_id("runs").locator("summary").click()
    shaded.get_by_test_id("sort-best").click()
    expect(shaded.get_by_test_id("runs").locator("tbody tr")).to_have_count(4)
    assert find_violations(shaded) == []
    (lab_server.root / "small" / "claims.json").unlink()
    shaded.goto("/#/results?study=gone")
    expect(shaded.get_by_test_id("results-empty")).to_be_visible()
    assert find_violations(shaded) == []


def test_the_life_that_plays_while_the_engine_is_compiled_has_none(
    shaded: Page, tmp_path: Path
) -> None:
    with run_server(tmp_path, lambda: False) as server:
        shaded.goto(server.entry)
        expect(shaded.get_by_test_id("first-canvas-count")).to_contain_text("of 20 ate")
        assert find_violations(shaded) == []
        shaded.goto("about:blank")


def test_a_shared_page_has_none(shaded: Page, lab_server: LabServer, tmp_path: Path) -> None:
    both: dict[str, Any] = {"a": LIFE, "b": urlencode(SMALL | {"condition": "evo/A"}), "step": 40}
    path = tmp_path / "shared.html"
    path.write_bytes(get_response(lab_server.address, "share", **both).content)
    shaded.goto(path.as_uri())
    expect(shaded.get_by_test_id("replay-step")).to_have_text("step 40 of 300")
    shaded.locator("summary").first.click()
    assert find_violations(shaded) == []
