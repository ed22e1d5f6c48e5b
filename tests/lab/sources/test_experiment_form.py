"""Tests of the form of an experiment, its errors, and the presets."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Page, expect
from pydantic import Field

from baldwinlab.experiment import Experiment, registry
from baldwinlab.lab.pages.single_page import STATIC_FOLDER
from baldwinlab.lab.sources.experiment_form import find_errors, make_form, make_schema
from baldwinlab.papers import built_in
from baldwinlab.parts.learning_rules import LearningRule
from tests.lab.client import CLIENT, LabServer, get_error, get_json
from tests.small_studies import shorten_preset


@pytest.fixture
def pulling() -> Iterator[str]:
    """Register a custom learning rule with a field."""

    class Pulling(LearningRule, name="pulling"):
        """Moves the weights toward those of other agents."""

        strength: float = Field(0.5, ge=0, le=1, description="size of a step")

    yield Pulling.name
    registry.remove("learning rule", "pulling")


def test_a_form_has_the_fields_of_an_experiment_and_the_available_parts() -> None:
    form = make_form(shorten_preset().to_dict())
    assert form["experiment"] == shorten_preset().to_dict()
    rule = form["schema"]["$defs"]["Learning"]["properties"]["rule"]
    assert rule["x-chooses"]
    assert {"none", "self-taught", "hebb"} <= set(rule["enum"])


def test_missing_fields_get_their_defaults() -> None:
    assert make_form({"name": "mine"})["experiment"] == Experiment(name="mine").to_dict()


def test_the_fields_of_a_part_are_present_only_while_it_is_selected(pulling: str) -> None:
    settings: Any = shorten_preset().to_dict()
    settings["learning"]["rule"] = pulling
    form = make_form(settings)
    assert form["experiment"]["learning"]["pulling"] == {"strength": 0.5}
    assert "Pulling" in form["schema"]["$defs"]
    form["experiment"]["learning"]["rule"] = "self-taught"
    next_form = make_form(form["experiment"])
    assert (
        next_form["experiment"]["learning"]
        == shorten_preset().replace(learning={"rule": "self-taught"}).to_dict()["learning"]
    )


def test_invalid_settings_are_returned_unchanged() -> None:
    settings: Any = shorten_preset().to_dict()
    settings["learning"]["rate"] = 11
    form = make_form(settings)
    assert form["experiment"] == settings
    assert form["schema"] == make_schema(Experiment)


@pytest.mark.parametrize("value", [None, 5, "evo/A", []])
def test_a_value_that_is_not_a_table_is_rejected(value: Any) -> None:
    assert find_errors(value) == [{"path": "", "message": "an experiment is a table of its fields"}]


def test_the_server_returns_the_form_and_the_appearance_of_an_experiment(
    lab_server: LabServer,
) -> None:
    def post(path: str) -> Any:
        return CLIENT.post(
            f"{lab_server.address}/api/{path}", json={"experiment": shorten_preset().to_dict()}
        ).json()

    assert post("schema") == make_form(shorten_preset().to_dict())
    appearance = post("appearance")
    assert appearance["appearance"]["actions"] == ["left", "forward", "right"]
    assert appearance["world"]["width"] == 640


def test_selecting_a_part_shows_its_fields_and_preserves_changed_values(
    page: Page, pulling: str
) -> None:
    page.goto("/#/live?preset=evo%2Bself-taught/A")
    page.get_by_test_id("group-learning").locator("summary").first.click()
    page.get_by_test_id("field-learning.rate").fill("0.5")
    page.get_by_test_id("field-learning.rule").select_option(pulling)
    strength = page.get_by_test_id("field-learning.pulling.strength")
    expect(strength).to_have_value("0.5")
    expect(page.get_by_test_id("group-learning.pulling")).to_contain_text(
        "Moves the weights toward those of other agents."
    )
    expect(page.get_by_test_id("field-learning.rate")).to_have_value("0.5")
    expect(page.get_by_test_id("group-learning")).to_have_attribute("open", "")
    page.get_by_test_id("group-learning.pulling").locator("summary").click()
    strength.fill("0.25")
    # The address is updated with a delay.
    expect(page).to_have_url(re.compile(r"pulling\.strength.*0\.25"))
    page.reload()
    expect(strength).to_have_value("0.25")
    page.get_by_test_id("group-learning").locator("summary").first.click()
    page.get_by_test_id("field-learning.rule").select_option("self-taught")
    expect(strength).to_have_count(0)
    expect(page.get_by_test_id("field-learning.rate")).to_have_value("0.5")
    expect(page.get_by_test_id("start")).to_be_enabled()


def test_too_few_runs_return_a_note_and_no_error(lab_server: LabServer) -> None:
    request = {"experiment": shorten_preset().to_dict(), "seed": 0}
    few, enough, wrong = (
        CLIENT.post(f"{lab_server.address}/api/validate", json=request | {"runs": runs}).json()
        for runs in (3, 5, 0)
    )
    assert few["errors"] == []
    assert few["note"] == (
        "To compare two conditions: with 3 runs and 2 tests, the smallest corrected p-value is 0.2."
        " At least 5 runs are needed. Set the number of runs to 5."
    )
    assert enough == {"errors": [], "note": ""}
    assert wrong["errors"] and wrong["note"] == ""


def test_values_without_a_known_type_are_shown_as_text(page: Page) -> None:
    page.goto("/")
    page.evaluate(
        """async () => {
          const { createForm } = await import("/live/form.js");
          const properties = { known: { type: "number" }, odd: { type: "object" }, any: {} };
          const unknown = { odd: { deep: [1, 2] }, any: { it: 3 }, strange: { table: "is text" } };
          const schema = { properties };
          const value = { known: 1, ...unknown };
          document.body.append(createForm(schema, value, () => {}, () => {}).element);
        }"""
    )
    expect(page.get_by_test_id("field-known")).to_have_value("1")
    expect(page.get_by_test_id("plain-strange")).to_contain_text("is text")
    expect(page.get_by_test_id("plain-odd.deep")).to_contain_text("2")
    expect(page.get_by_test_id("plain-any")).to_contain_text("3")


def test_the_presets_are_listed_with_their_descriptions_and_the_default(
    lab_server: LabServer,
) -> None:
    response = get_json(lab_server.address, "presets")
    names = [preset["name"] for preset in response["presets"]]
    assert {"evo/A", "self-taught/B"} <= set(names)
    assert all(preset["description"] for preset in response["presets"])
    assert response["default"] == "evo+self-taught/A"
    assert len(response["choices"]) == 4
    assert set(response["choices"]) <= {preset["name"] for preset in response["presets"]}
    (shown,) = (preset for preset in response["presets"] if preset["shown"])
    assert (shown["name"], shown["world"]) == (
        "evo+self-taught/B",
        {"generations": 100, "agents": 20, "steps": 5000},
    )
    assert get_json(lab_server.address, "preset", name="evo/B")["name"] == "evo/B"
    message = get_error(lab_server.address, "preset", 404, name="evo/Z")
    assert message.startswith("there is no preset 'evo/Z' (did you mean 'evo/")
    assert len(message) < 200


def test_the_modules_of_the_page_contain_no_preset_name() -> None:
    names = {
        preset
        for paper in built_in().values()
        for preset in paper.experiment_names()
        if len(preset) > 1
    }
    # A command of the explorable names presets.
    folders = {"vendor", "explorable"}
    paths = [path for path in STATIC_FOLDER.rglob("*.js") if path.parent.name not in folders]
    for path in paths:
        assert not {name for name in names if f'"{name}"' in path.read_text("utf-8")}, path.name
