"""Tests of the page with a study whose model is not loaded and has negative fitness."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from tests.lab.client import LabServer
from tests.lab.conftest import hawks_study, run_server
from tests.small_studies import make_small_study, shorten_preset


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
