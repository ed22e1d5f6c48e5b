"""Tests of the page with a custom model: without a world, or not loaded."""

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
from tests.lab.conftest import hawks_study, run_server
from tests.small_studies import make_small_study, shorten_preset

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
    assert len(results["curves"]["bit-strings"]["best"]["center"]) == 5
    query = {"study": "bits", "condition": "bit-strings", "run": 0, "generation": 0}
    assert "is not loaded" in get_error(server.address, "recording", 400, **query)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    root = tmp_path_factory.mktemp("missing")
    make_small_study(root / "sound", [shorten_preset()], runs=1)
    with hawks_study(root / "hawks"), run_server(root) as lab_server:
        yield lab_server


def test_a_study_whose_model_is_not_loaded_hides_nothing(page: Page, server: LabServer) -> None:
    page.goto(server.entry)
    expect(page.get_by_test_id("message-info")).to_contain_text("Not playable: hawks.")
    # The newest study cannot be played.
    expect(page.get_by_test_id("condition-a")).to_have_value("evo+self-taught/A")
    expect(page.get_by_test_id("message-error")).to_have_count(0)
    page.goto(f"{server.entry}#/results")
    expect(page.get_by_test_id("results-study")).to_have_value("hawks")
    expect(page.get_by_test_id("curves")).to_be_visible()
    note = page.get_by_test_id("missing-parts")
    expect(note).to_contain_text(f"--part {server.root}/hawks/parts/model-hawks-and-doves.py")
    sentence = note.inner_text()
    page.goto(f"{server.address}/#/world?study=hawks")
    expect(page.get_by_test_id("missing-lifetime")).to_contain_text(sentence)


def test_charts_of_negative_fitness_show_all_values(page: Page, server: LabServer) -> None:
    page.goto(f"{server.entry}#/results?study=hawks")
    page.get_by_test_id("finals").locator("summary").first.click()
    boxes = page.get_by_test_id("final-mean").locator("svg")
    expect(boxes.locator("text").first).to_have_text("-50")
    # Both positions are read in one step, because the page can draw the chart again.
    page.wait_for_function("""() => {
      const chart = document.querySelector("[data-testid=final-mean] svg");
      const dot = chart?.querySelector("circle")?.getBoundingClientRect();
      const frame = chart?.getBoundingClientRect();
      return dot && frame && frame.top < dot.top && dot.bottom < frame.bottom;
    }""")
    # The curve is the picture of the numbers that screen readers get.
    expect(page.get_by_test_id("curves").locator(".chart-value").first).to_be_attached()
    [low, high] = page.evaluate(
        """async () => (await import("/charts/chart_series.js")).computeAxisRange([-50, -50])"""
    )
    assert (low, high) == (-52.5, 0)
