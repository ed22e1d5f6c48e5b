"""Tests of the quantiles of several live runs."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.studies.open import open_runs
from tests.lab.client import LabServer
from tests.lab.conftest import run_server
from tests.lab.test_live_pages import post

CHANGES = {"evolution.generations": 3, "lifetime.steps": 100}
SHARES = {"low": (0.25, 0.05), "high": (0.75, 0.95)}


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    with run_server(tmp_path_factory.mktemp("ensemble")) as opened:
        yield opened


@pytest.fixture
def page(browser: Browser, server: LabServer) -> Iterator[Page]:
    with server.open_page(browser, viewport={"width": 1280, "height": 800}) as page:
        yield page


def test_the_curves_of_an_ensemble_are_the_quantiles_of_its_runs(
    page: Page, server: LabServer, tmp_path: Path
) -> None:
    page.goto(f"/#/live?runs=7&pace=0&set={json.dumps(CHANGES)}")
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    page.get_by_test_id("statistic").select_option("median")
    fitness = page.get_by_test_id("live-fitness")
    expect(fitness).to_contain_text("median, 50 % and 90 % of 7 runs")
    with page.expect_download() as download:
        fitness.get_by_test_id("saves-fitness").locator("summary").click()
        fitness.get_by_test_id("download-fitness.csv").click()
    download.value.save_as(tmp_path / "fitness.csv")
    with (tmp_path / "fitness.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    id = page.url.partition("id=")[2][:8]
    status, _ = post(server, f"live/{id}/save", {"name": "saved"})
    assert status == 201
    means = open_runs(server.root / "saved").energy.isel(condition=0).mean("agent")
    for name, index in (("median, 50 %", 0), ("90 %", 1)):
        curve = [row for row in rows if row["curve"] == f"average agent: {name}"]
        assert len(curve) == CHANGES["evolution.generations"]
        for edge, shares in SHARES.items():
            expected = np.quantile(means, shares[index], axis=0)
            assert np.allclose([float(row[edge]) for row in curve], expected)
        if index == 0:
            medians = [float(row["median"]) for row in curve]
            assert np.allclose(medians, np.median(means, axis=0))
    # A link restores the statistic. The address follows the page with a delay.
    expect(page).to_have_url(re.compile("statistic=median"))
    page.reload()
    expect(page.get_by_test_id("live-fitness")).to_contain_text("median, 50 %")
