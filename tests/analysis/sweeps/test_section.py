"""Page of a sweep: sentences, figures and its layout in a browser."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import parse_qs

import numpy as np
import pytest
import xarray as xr
from playwright.sync_api import Browser

from baldwinlab.analysis.report.data import Link
from baldwinlab.analysis.results.contrasts import Contrasts, compare_final_values
from baldwinlab.analysis.results.headlines import summarize_contrasts
from baldwinlab.analysis.sweeps.analysis import compute_finals
from baldwinlab.analysis.sweeps.figures import draw_heat_maps
from baldwinlab.analysis.sweeps.section import (
    describe_effects,
    describe_ranges,
    draw_figures,
    link_points,
    summarize_design,
    write_sweep_report,
)
from baldwinlab.experiment.conditions import Factors
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
    counts = "1 to 20, 20 different values (number of items in the region at any time)"
    assert summary["world.food.0.count"] == counts


def compare_counts(data: xr.Dataset) -> Contrasts:
    """Compare all points of a sweep with its first point."""
    finals = compute_finals(data).rename(point="condition")
    values = finals[["mean", "best"]].reset_coords(drop=True)
    names = [f"point {number}" for number in range(finals.sizes["condition"])]
    named = values.assign_coords(condition=names)
    return compare_final_values(named, dict.fromkeys(names, Factors()), 10)


def test_a_sentence_about_a_point_has_its_interval() -> None:
    sentences = summarize_contrasts(compare_counts(grid(runs=12)))
    assert re.fullmatch(
        r"5 conditions compared with point 0 in fitness: \d (higher|lower)(, \d (\w+))*\.",
        sentences[0],
    )
    assert len(sentences) > 1
    for sentence in sentences[1:]:
        assert re.fullmatch(
            r"The fitness of agents of point \d is \S+ (higher|lower) than that of agents of "
            r"point 0 \[\S+, \S+\]\.",
            sentence,
        )


def test_sentences_state_rank_correlations_intervals_and_missing_tests() -> None:
    assert summarize_contrasts(compare_counts(grid())) == [
        "5 conditions compared with point 0 in fitness: 5 too few runs."
    ]
    assert list(describe_effects(compute_finals(grid()))) == [
        "This report compares no points by a test."
    ]
    sentences = list(describe_effects(compute_finals(sample(40))))
    (sentence,) = (text for text in sentences if text.startswith("world.food.0.count is corr"))
    assert ": rank correlation +" in sentence and sentence.endswith(", 40 points.")
    assert next(describe_ranges(compute_finals(grid()))).startswith(
        "By learning.rate, the mean of fitness of the average agent is between 3.83 ["
    )


@pytest.mark.usefixtures("placeholder_figures")
def test_a_grid_has_curves_heat_maps_and_every_point(tmp_path: Path) -> None:
    text = page_of(grid(), tmp_path).read_text("utf-8")
    assert "<h1>evo/A: sweep of learning.rate and world.food.0.count</h1>" in text
    names = {path.stem for path in (tmp_path / "figures").iterdir()}
    assert names == {"responses", "responses-learning.rate-world.food.0.count"}
    assert "6 points" in text and "Rank correlations" not in text
    # Along the count: the mean over runs of 50 items, and its interval.
    assert "12.0 [9.52, 14.5]" in text
    # The answer and the heat map are before the curves and all tables.
    heat_map = text.index('id="figure-responses-learning.rate-world.food.0.count"')
    order = [text.index(part) for part in ('<p class="lead">By learning.rate, ', "<table")]
    assert order[0] < heat_map < text.index('id="figure-responses"') < order[1]


@pytest.mark.usefixtures("placeholder_figures")
def test_levels_that_differ_little_stay_distinct_and_files_have_the_values(tmp_path: Path) -> None:
    rates = [0.012341, 0.012342]
    data = grid().assign_coords({"learning.rate": rates})
    data["learning.rate"].attrs = grid()["learning.rate"].attrs
    finals = compute_finals(data)
    assert dict(summarize_design(finals))["learning.rate"].startswith("0.012341, 0.012342 (")
    text = page_of(data, tmp_path).read_text("utf-8")
    assert text.count(">0.012341<") == text.count(">0.012342<") >= 4
    for figure in draw_figures(finals):
        values = [row["learning.rate"] for row in figure.table]
        assert sorted(set(values)) == rates
    heat_map = draw_heat_maps(finals, "learning.rate", "world.food.0.count")
    labels = [label.get_text() for label in heat_map.axes[0].get_yticklabels()]
    assert labels == ["0.012341", "0.012342"]
    sampled = sample(9)
    close = np.linspace(0.012341, 0.012349, 9)
    sampled["learning.rate"] = ("point", close, sampled["learning.rate"].attrs)
    links = link_points(
        compute_finals(sampled), [f"point-{number}" for number in range(9)], [5] * 9
    )
    assert [link.label.split(",")[0] for link in links] == [
        "learning.rate = 0.012345",
        "learning.rate = 0.012349",
    ]


@pytest.mark.usefixtures("placeholder_figures")
def test_a_sweep_without_a_finite_value_has_a_page(tmp_path: Path) -> None:
    data = grid()
    data.energy[:] = data.food_eaten[:] = np.nan
    assert "world.food.0.count. No point has runs." in page_of(data, tmp_path).read_text("utf-8")


@pytest.mark.usefixtures("placeholder_figures")
def test_a_sample_has_rank_correlations_and_no_heat_map(tmp_path: Path) -> None:
    text = page_of(sample(20), tmp_path).read_text("utf-8")
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == {"responses"}
    assert "Rank correlations" in text and "Sobol sample" in text


@pytest.mark.usefixtures("placeholder_figures")
@pytest.mark.parametrize("data", [grid(runs=1), sample(1), sample(4)])
def test_small_sweeps_have_a_page_too(data: xr.Dataset, tmp_path: Path) -> None:
    text = page_of(data, tmp_path).read_text("utf-8")
    assert "nan" not in re.sub(r'"data:[^"]*"', "", text).lower()


@pytest.mark.usefixtures("placeholder_figures")
def test_a_point_without_a_run_is_a_dash(tmp_path: Path) -> None:
    holed = grid()
    holed.energy[0, 1] = holed.food_eaten[0, 1] = np.nan
    text = page_of(holed, tmp_path).read_text("utf-8")
    assert '<td class="right">0</td><td class="right">–</td>' in text


@pytest.mark.usefixtures("placeholder_figures")
@pytest.mark.parametrize("data", [grid(), sample(40)], ids=["grid", "sample"])
def test_a_browser_shows_the_page_without_errors_or_horizontal_scrolling(
    browser: Browser, data: xr.Dataset, tmp_path: Path
) -> None:
    page = page_of(data, tmp_path)
    for width, height in ((1280, 900), (390, 844)):  # on a desk, on a phone
        assert errors_and_width(browser, page, width, height) == ([], width)


def read_query(link: Link) -> dict[str, str]:
    return {key: value for key, (value,) in parse_qs(link.address.split("?")[1]).items()}


def test_each_of_a_few_points_has_a_link_to_the_last_generation_of_its_median_run() -> None:
    # The energy of the runs of this grid rises with their number, so that run 1 has the median.
    names = [f"point-{number}" for number in range(6)]
    links = link_points(compute_finals(grid(runs=3)), names, [5] * 6)
    for link, count in zip(links, (0, 10), strict=False):
        assert link.label == f"learning.rate = 0.1, world.food.0.count = {count}"
    assert len(links) == 6
    query = read_query(links[1])
    assert query == {"study": ".", "condition": "point-1", "run": "1", "generation": "4"}
    # A point without runs has no link.
    finals = compute_finals(grid(runs=3))
    finals["mean"][2] = np.nan
    links = link_points(finals, list("abcdef"), [1] * 6)
    assert [read_query(link)["condition"] for link in links] == list("abdef")


def test_of_many_points_those_with_the_lowest_and_the_highest_mean_have_links() -> None:
    finals = compute_finals(sample(20))
    eaten = finals["mean"].mean("run").values
    links = link_points(finals, [str(point) for point in range(20)], [1] * 20)
    ends = sorted([int(np.argmin(eaten)), int(np.argmax(eaten))])
    assert [int(read_query(link)["condition"]) for link in links] == ends
