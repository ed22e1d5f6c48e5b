"""Responses to the fields of a sweep, computed for artificial sweeps."""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.sweeps import analysis as responses
from tests.analysis.sweeps.made import GRID_ENERGY, grid, sample

RATE = "learning.rate"
COUNT = "world.food.0.count"


def test_points_of_a_grid_have_the_order_of_its_file_and_tables_ascending_values() -> None:
    measured = responses.compute_finals(grid())
    assert measured["mean"].dims == ("point", "run")
    assert measured[RATE].values.tolist() == [0.1, 0.1, 0.1, 0.01, 0.01, 0.01]
    assert measured[COUNT].values.tolist() == [0, 10, 50, 0, 10, 50]
    assert measured["mean"].mean("run").values.tolist() == list(GRID_ENERGY.ravel())
    assert responses.list_pairs(grid()) == [(RATE, COUNT)]
    table = responses.compute_table(responses.compute_finals(grid()), RATE, COUNT, "mean")
    assert table.tolist() == GRID_ENERGY[::-1].tolist()
    assert responses.list_pairs(sample(4)) == []


def test_a_response_is_the_mean_over_all_other_fields_with_the_interval_over_runs() -> None:
    measured = responses.compute_finals(grid(runs=2))
    curve = responses.compute_responses(measured, COUNT, "mean")
    groups = [(response.group, response.points) for response in curve]
    assert groups == [("0", 2), ("10", 2), ("50", 2)]
    assert [response.mean for response in curve] == [0, 3, 12]
    # The t of one degree of freedom; runs differ by 1.
    half = 12.706204736174698 * math.sqrt(2) * 0.5 / math.sqrt(2)
    assert half > 3, "but fitness is not below 0"
    np.testing.assert_allclose([curve[1].low, curve[1].high], [0, 3 + half])
    assert curve[0].low == curve[0].high == 0


def test_a_field_without_effect_has_a_flat_response() -> None:
    measured = responses.compute_finals(grid(flat=True))
    first, second = responses.compute_responses(measured, RATE, "best")
    assert first.mean == second.mean


def test_a_single_run_has_no_interval_and_a_missing_run_is_left_out() -> None:
    (first, *_) = responses.compute_responses(responses.compute_finals(grid(runs=1)), COUNT, "mean")
    assert first.mean == 0 and math.isnan(first.low) and math.isnan(first.high)
    holed = grid(runs=2)
    holed.energy[0, 1, 1] = np.nan
    table = responses.tabulate_points(responses.compute_finals(holed))
    rows = [row for row in table if row["measure"] == "mean"]
    assert [row["runs"] for row in rows] == [2, 1, 2, 2, 2, 2]
    assert math.isnan(rows[1]["low"]) and rows[1]["mean"] == 1


def test_a_sample_is_grouped_by_quantiles_and_every_point_is_in_one_group() -> None:
    measured = responses.compute_finals(sample(40))
    groups = responses.group_points(measured, RATE)
    assert [len(group.points) for group in groups] == [5] * 8
    assert sorted(np.concatenate([group.points for group in groups])) == list(range(40))
    assert [group.position for group in groups] == sorted(group.position for group in groups)
    assert len(responses.group_points(responses.compute_finals(sample(12)), RATE)) == 2
    label, position, points = responses.group_points(measured, "evolution.selection")[1]
    assert (label, position, points.tolist()) == ("roulette", 1, list(range(1, 40, 2)))


def test_a_sample_shows_the_fields_that_a_measure_depends_on() -> None:
    measured = responses.compute_finals(sample(64))
    means = [response.mean for response in responses.compute_responses(measured, COUNT, "mean")]
    assert means == sorted(means) and means[-1] > 4 * means[0]
    first = responses.compute_responses(measured, COUNT, "mean")[0]
    assert first.low < first.mean < first.high
    correlations = {
        (correlation.field, correlation.measure): correlation
        for correlation in responses.compute_correlations(measured)
    }
    assert correlations[COUNT, "mean"].rho > 0.95 and correlations[COUNT, "mean"].p_holm < 1e-9
    assert abs(correlations[RATE, "mean"].rho) < 0.3 and correlations[RATE, "mean"].p_holm > 0.05
    # All agents eat in all runs, and a text has no rank.
    assert math.isnan(correlations[COUNT, "share"].rho)
    assert not any(field == "evolution.selection" for field, _ in correlations)
    # Two points have no correlation.
    for correlation in responses.compute_correlations(responses.compute_finals(sample(2))):
        assert math.isnan(correlation.rho) and math.isnan(correlation.p_holm)


def test_the_csv_file_has_a_row_for_each_point_and_measure(tmp_path: Path) -> None:
    responses.write_responses(responses.compute_finals(grid(runs=1)), tmp_path)
    lines = (tmp_path / "responses.csv").read_text().splitlines()
    assert lines[0] == "point,learning.rate,world.food.0.count,measure,runs,mean,low,high"
    assert len(lines) == 1 + 6 * 3
    assert lines[5] == "1,0.1,10,mean,1,1.5,,"


@pytest.mark.parametrize(
    "data", [grid(runs=1), sample(1), sample(3), grid().isel({RATE: [0], COUNT: [0]})]
)
def test_small_sweeps_are_evaluated_without_a_warning(data: xr.Dataset) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        measured = responses.compute_finals(data)
        for field in data.attrs["fields"]:
            assert responses.compute_responses(measured, field, "share")
        responses.compute_correlations(measured)
        assert len(responses.tabulate_points(measured)) == 3 * measured.sizes["point"]
