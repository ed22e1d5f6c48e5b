"""A form knows which fields an experiment has, whatever parts it chooses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Page, expect
from pydantic import Field

from baldwinlab.experiment import Experiment, registry
from baldwinlab.lab.experiment_form import form_of
from baldwinlab.lab.schema import schema_of
from baldwinlab.parts.learning_rules import LearningRule
from tests.lab.client import CLIENT, LabServer
from tests.small_studies import shorten_preset


@pytest.fixture
def pulling() -> Iterator[str]:
    """A learning rule of one's own, with a field."""

    class Pulling(LearningRule, name="pulling"):
        """Is pulled towards others."""

        strength: float = Field(0.5, ge=0, le=1, description="how strongly")

    yield Pulling.name
    registry.remove("learning rule", "pulling")


def test_a_form_of_an_experiment_has_its_fields_and_what_may_be_chosen() -> None:
    found = form_of(shorten_preset().to_dict())
    assert found["errors"] == []
    assert found["experiment"] == shorten_preset().to_dict()
    rule = found["schema"]["$defs"]["Learning"]["properties"]["rule"]
    assert rule["x-chooses"]
    assert {"none", "self-taught", "drift"} <= set(rule["enum"])


def test_what_is_left_out_is_completed() -> None:
    assert form_of({"name": "mine"})["experiment"] == Experiment(name="mine").to_dict()


def test_the_table_of_a_part_comes_when_it_is_chosen_and_goes_when_it_is_not(pulling: str) -> None:
    tree: Any = shorten_preset().to_dict()
    tree["learning"]["rule"] = pulling
    chosen = form_of(tree)
    assert chosen["experiment"]["learning"]["pulling"] == {"strength": 0.5}
    assert "Pulling" in chosen["schema"]["$defs"]
    chosen["experiment"]["learning"]["rule"] = "drift"
    again = form_of(chosen["experiment"])
    assert again["errors"] == []
    assert (
        again["experiment"]["learning"]
        == shorten_preset().replace(learning={"rule": "drift"}).to_dict()["learning"]
    )


def test_what_is_wrong_comes_back_as_it_is_with_the_faults() -> None:
    tree: Any = shorten_preset().to_dict()
    tree["learning"]["rate"] = 11
    found = form_of(tree)
    assert found["experiment"] == tree
    assert [fault["path"] for fault in found["errors"]] == ["learning.rate"]
    assert found["schema"] == schema_of(Experiment)


@pytest.mark.parametrize("tree", [None, 5, "evo/A", []])
def test_what_is_no_table_is_told_so(tree: Any) -> None:
    assert form_of(tree)["errors"] == [
        {"path": "", "message": "an experiment is a table of its fields"}
    ]


def test_a_form_and_a_look_are_posted_for(lab_server: LabServer) -> None:
    def post(path: str) -> Any:
        return CLIENT.post(
            f"{lab_server.address}/api/{path}", json={"experiment": shorten_preset().to_dict()}
        ).json()

    assert post("schema") == form_of(shorten_preset().to_dict())
    found = post("appearance")
    assert found["appearance"]["actions"] == ["left", "forward", "right"]
    assert found["world"]["width"] == 640


def test_choosing_a_part_shows_its_fields_and_keeps_what_was_changed(
    page: Page, pulling: str
) -> None:
    page.goto("/#/live?preset=evo%2Bself-taught/A")
    page.get_by_test_id("group-learning").locator("summary").first.click()
    page.get_by_test_id("field-learning.rate").fill("0.5")
    page.get_by_test_id("field-learning.rule").select_option(pulling)
    strength = page.get_by_test_id("field-learning.pulling.strength")
    expect(strength).to_have_value("0.5")
    expect(page.get_by_test_id("group-learning.pulling")).to_contain_text(
        "Is pulled towards others."
    )
    expect(page.get_by_test_id("field-learning.rate")).to_have_value("0.5")
    expect(page.get_by_test_id("group-learning")).to_have_attribute("open", "")
    page.get_by_test_id("group-learning.pulling").locator("summary").click()
    strength.fill("0.25")
    page.wait_for_timeout(600)  # the address follows a moment later
    page.reload()
    expect(strength).to_have_value("0.25")
    page.get_by_test_id("group-learning").locator("summary").first.click()
    page.get_by_test_id("field-learning.rule").select_option("drift")
    expect(strength).to_have_count(0)
    expect(page.get_by_test_id("field-learning.rate")).to_have_value("0.5")
    expect(page.get_by_test_id("start")).to_be_enabled()


def test_too_few_runs_are_noted_and_not_refused(lab_server: LabServer) -> None:
    order = {"experiment": shorten_preset().to_dict(), "seed": 0}
    few, enough, wrong = (
        CLIENT.post(f"{lab_server.address}/api/validate", json=order | {"runs": runs}).json()
        for runs in (3, 5, 0)
    )
    needed = "with 3 runs and 2 tests, the smallest corrected p-value is 0.2. At least 5 runs are needed."
    assert few == {"errors": [], "note": f"To compare two conditions: {needed}"}
    assert enough == {"errors": [], "note": ""}
    assert wrong["errors"] and wrong["note"] == ""


def test_what_a_form_does_not_know_is_shown_as_it_is(page: Page) -> None:
    page.goto("/")
    page.evaluate(
        """async () => {
          const { schemaForm } = await import("/form.js");
          const schema = { properties: { known: { type: "number" }, odd: { type: "object" }, any: {} } };
          const value = { known: 1, odd: { deep: [1, 2] }, any: { it: 3 }, strange: { table: "is text" } };
          document.body.append(schemaForm(schema, value, () => {}, () => {}).element);
        }"""
    )
    expect(page.get_by_test_id("field-known")).to_have_value("1")
    expect(page.get_by_test_id("plain-strange")).to_contain_text("is text")
    expect(page.get_by_test_id("plain-odd.deep")).to_contain_text("2")
    expect(page.get_by_test_id("plain-any")).to_contain_text("3")
