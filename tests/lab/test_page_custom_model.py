"""Tests of a custom model without a world in the lab."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import pytest
from playwright.sync_api import Page, expect

import baldwinlab as bl
from baldwinlab.experiment import registry
from baldwinlab.parts import load_file
from tests.lab.client import LabServer, get_error, get_json
from tests.lab.conftest import run_server

PART = Path(__file__).parents[2] / "examples" / "parts" / "bit_strings.py"
CHANGES = {
    "bit_strings.guesses": 40,
    "bit_strings.loci": 6,
    "population.size": 40,
    "evolution.generations": 5,
}


@pytest.fixture
def custom_model() -> Iterator[None]:
    """Load the model and its variation, and remove them after the test."""
    load_file(PART)
    yield
    remove_custom_model()


def remove_custom_model() -> None:
    for kind, name in (("model", "bit-strings"), ("variation", "one-point")):
        registry.remove(kind, name)


@pytest.mark.usefixtures("custom_model")
def test_a_custom_model_is_simulated_saved_and_shown(page: Page, tmp_path: Path) -> None:
    with run_server(tmp_path) as server:
        require_saved_run(page, server)


def require_saved_run(page: Page, server: LabServer) -> None:
    presets = {preset["name"]: preset for preset in get_json(server.address, "presets")["presets"]}
    description = presets["bit-strings"]["description"]
    assert description == "Strings of the alleles 0, 1 and ?, with guesses for each ?."
    changes = quote(json.dumps(CHANGES), safe="")
    page.goto(f"{server.entry}#/live?preset=bit-strings&runs=2&pace=0&set={changes}")
    expect(page.get_by_test_id("field-bit_strings.guesses")).to_have_value("40")
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    expect(page.get_by_test_id("live-no-world")).to_have_text(
        "The model bit-strings has no world to show."
    )
    expect(page.get_by_test_id("live-fitness")).to_contain_text("Fitness, mean of 2 runs")
    page.get_by_test_id("save").click()
    page.get_by_test_id("save-name").fill("bits")
    page.keyboard.press("Enter")
    page.get_by_test_id("open-saved").click()
    expect(page.get_by_test_id("curves")).to_contain_text("Fitness of the average agent")
    saved_part = server.root / "bits" / "parts" / "model-bit-strings.py"
    assert saved_part.read_bytes() == PART.read_bytes()
    page.goto(f"{server.entry}#/world?study=bits&condition=bit-strings&run=0&generation=0")
    expect(page.get_by_role("alert")).to_contain_text("has no world to show")


@pytest.mark.usefixtures("custom_model")
def test_a_stored_study_is_shown_without_its_part_but_not_simulated(tmp_path: Path) -> None:
    experiment = bl.load("bit-strings").replace(evolution={"generations": 5})
    bl.run([experiment], runs=2, out=tmp_path / "bits")
    remove_custom_model()
    with run_server(tmp_path) as server:
        require_results_without_part(server)


def require_results_without_part(server: LabServer) -> None:
    (study,) = get_json(server.address, "studies")["studies"]
    (condition,) = study["conditions"]
    assert (condition["name"], condition["steps"]) == ("bit-strings", None)
    results = get_json(server.address, "results", study="bits")
    run = get_json(server.address, "run", study="bits", condition="bit-strings", run=0)
    assert run["measure"] == "fitness"
    assert results["measures"]["best"]["axis"] == run["measure"]
    assert len(results["curves"]["bit-strings"]["best"]["mean"]) == 5
    query = {"study": "bits", "condition": "bit-strings", "run": 0, "generation": 0}
    assert "load its file, for example the copy" in get_error(
        server.address, "recording", 400, **query
    )
