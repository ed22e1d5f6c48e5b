"""Tests of the pages of experiments with several species."""

from __future__ import annotations

import json
from urllib.parse import quote

import pytest
from playwright.sync_api import Page, expect

QUICK = {"lifetime.steps": 120, "evolution.generations": 3}


def start_live_run(page: Page) -> None:
    """Start a live run of predators and prey, and wait for the end of its last generation."""
    changes = quote(json.dumps(QUICK), safe="")
    page.goto(f"/#/live?preset=no-learning&runs=2&set={changes}")
    page.get_by_test_id("start").click()
    # Two species are compiled first.
    expect(page.get_by_test_id("live-state")).to_have_text("Done")


@pytest.mark.nightly
def test_a_live_run_draws_a_shape_and_a_curve_for_each_species(page: Page) -> None:
    start_live_run(page)
    legend = page.get_by_test_id("legend-species")
    expect(legend).to_have_text("predatorsprey")
    shapes = legend.locator("svg").evaluate_all("marks => marks.map(mark => mark.dataset.shape)")
    assert shapes == ["circle", "triangle"]
    for chart in ("live-fitness", "live-share", "live-counts"):
        labels = page.get_by_test_id(chart).locator(".chart-key").all_text_contents()
        assert [label.rstrip("0123456789.") for label in labels] == ["predators", "prey"]
