"""Page of a sweep: sentences, figures and its layout in a browser."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from playwright.sync_api import Browser

from baldwinlab.analysis.sweeps.analysis import compute_finals
from baldwinlab.analysis.sweeps.section import (
    describe_responses,
    summarize_design,
    write_sweep_report,
)
from tests.analysis.report.browsing import errors_and_width
from tests.analysis.sweeps.made import grid, sample

FACTS = {"versions": {"NumPy": "9.9"}, "seconds": 10, "agent_steps": 2_000_000_000, "workers": [2]}


def page_of(data: xr.Dataset, folder: Path) -> Path:
    return write_sweep_report(folder, compute_finals(data), FACTS, folder / "report.html")


def test_the_summary_names_the_swept_fields() -> None:
    summary = dict(summarize_design(compute_finals(grid())))
    assert summary["experiment"] == "evo/A, lifetime.steps = 1000"
    assert summary["learning.rate"] == "0.01, 0.1 (learning rate, per step)"
    assert (summary["points"], summary["runs per point"], summary["seed"]) == ("6", "3", "7")
    summary = dict(summarize_design(compute_finals(sample(20))))
    assert (
        summary["world.food.0.count"]
        == "1 to 20, 20 different values (number of items in the region at any time)"
    )


def test_sentences_name_the_best_point_and_the_effect_of_each_field() -> None:
    assert list(describe_responses(compute_finals(grid()))) == [
        "The mean fitness of the average agent is highest at learning.rate = 0.01, "
        "world.food.0.count = 50: 14.0.",
        "By learning.rate, it ranges from 3.83 (0.1) to 6.17 (0.01).",
        "By world.food.0.count, it ranges from 0 (0) to 12.0 (50).",
    ]


def test_a_grid_has_curves_heat_maps_and_every_point(tmp_path: Path) -> None:
    text = page_of(grid(), tmp_path).read_text("utf-8")
    assert "<h1>evo/A: sweep of learning.rate and world.food.0.count</h1>" in text
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == {
        "responses",
        "responses-learning.rate-world.food.0.count",
    }
    assert "6 points" in text and "Rank correlations" not in text
    assert (
        "12.0 [9.52, 14.5]" in text
    )  # along the count: mean over runs of 50 items, and its interval


def test_a_sample_has_rank_correlations_and_no_heat_map(tmp_path: Path) -> None:
    text = page_of(sample(20), tmp_path).read_text("utf-8")
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == {"responses"}
    assert "Rank correlations" in text and "Sobol sample" in text


@pytest.mark.parametrize("data", [grid(runs=1), sample(1), sample(4)])
def test_small_sweeps_have_a_page_too(data: xr.Dataset, tmp_path: Path) -> None:
    text = page_of(data, tmp_path).read_text("utf-8")
    assert "nan" not in re.sub(r'src="[^"]*"', "", text).lower()


def test_a_point_without_a_run_is_a_dash(tmp_path: Path) -> None:
    holed = grid()
    holed.energy[0, 1] = holed.food_eaten[0, 1] = np.nan
    assert '<td class="right">0</td><td class="right">–</td>' in page_of(holed, tmp_path).read_text(
        "utf-8"
    )


@pytest.mark.parametrize("data", [grid(), sample(40)], ids=["grid", "sample"])
def test_a_browser_shows_the_page_without_errors_or_horizontal_scrolling(
    browser: Browser, data: xr.Dataset, tmp_path: Path
) -> None:
    page = page_of(data, tmp_path)
    for width, height in ((1280, 900), (390, 844)):  # on a desk, on a phone
        assert errors_and_width(browser, page, width, height) == ([], width)
