"""Response of the final fitness to the fields of a sweep.

A point of a sweep is one combination of field values. The value of a run is its average over the
last generations. In a grid or a list, each run is averaged over the points with the same value, and
intervals are for the mean over runs. In a random or a Sobol sample, each point is averaged over the
runs, and intervals are for the mean over points.

Rank correlation: C. Spearman, American Journal of Psychology 15 (1904).
"""

from __future__ import annotations

from itertools import combinations
from math import isnan, nan
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy import stats

from baldwinlab.analysis import statistics
from baldwinlab.analysis.results.numbers import format_levels, to_csv
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.intervals import interval_of_mean
from baldwinlab.core.file_writing import write_atomically

# Smallest and largest number of groups of a field's values.
MIN_GROUPS: Final = 2
MAX_GROUPS: Final = 8
# Smallest number of points for a rank correlation.
MIN_CORRELATED_POINTS: Final = 3
# Number of points per group of several values, unless `MAX_GROUPS` or `MIN_GROUPS` limits it.
MIN_GROUP_POINTS: Final = 5
# Columns of responses.csv after the fields.
RESPONSE_COLUMNS: Final = ("measure", "runs", "mean", "low", "high")


class Group(NamedTuple):
    """Points with the same value of a field, or with neighboring values."""

    label: str
    # Position on the axis: a value, the median of several values, or the index of a text.
    position: float
    points: npt.NDArray[np.intp]  # Indices of the points.


class Response(NamedTuple):
    """Mean of a measure over a group of points, with the 95 % interval. NaN if undefined."""

    field: str
    group: str
    position: float
    measure: str
    points: int  # Number of points.
    mean: float
    low: float
    high: float


class Correlation(NamedTuple):
    """Spearman's correlation of a field with the mean of a measure over runs, by point."""

    field: str
    measure: str
    points: int
    rho: float
    p: float  # Two-sided p-value, by Student's t.
    p_holm: float = nan  # p, corrected for all fields and measures.


def compute_finals(sweep: xr.Dataset, last: int = 10) -> xr.Dataset:
    """Average each measure over the last generations (point, run). Fields become coordinates."""
    averages = {measure: fitness.final(sweep, measure, last) for measure in fitness.MEASURES}
    finals = xr.Dataset(averages, attrs=sweep.attrs)
    if "point" not in finals.dims:
        finals = _stack_grid(finals, sweep)
    return finals.transpose("point", "run")


def _stack_grid(finals: xr.Dataset, sweep: xr.Dataset) -> xr.Dataset:
    """Replace the dimensions of a grid by one dimension `point`."""
    fields = sweep.attrs["fields"]
    attributes = {field: dict(sweep[field].attrs) for field in fields}
    finals = finals.stack(corner=fields).reset_index("corner").rename(corner="point")
    finals = finals.assign_coords(point=np.arange(finals.sizes["point"]))
    for field in fields:
        finals[field].attrs = attributes[field]
    return finals


def is_sampled(sweep: xr.Dataset) -> bool:
    """Return whether the points are a random or a Sobol sample."""
    return sweep.attrs["design"] in ("random", "sobol")


def is_number(values: xr.DataArray) -> bool:
    """Return whether the values of a field are numbers."""
    return bool(np.issubdtype(values.dtype, np.number))


def list_values(values: xr.DataArray) -> list[Any]:
    """Return the distinct values of a field: numbers in ascending order, texts as declared."""
    if is_number(values):
        return list(np.unique(values.values).tolist())
    return list(dict.fromkeys(values.values.tolist()))


def group_points(finals: xr.Dataset, field: str) -> list[Group]:
    """Group the points by their value of a field. Groups of numbers are in ascending order.

    If a sample or a list has more than eight different numbers, quantiles form up to eight groups
    of similar size, with about five points or more each.
    """
    values = finals[field].values
    distinct = list_values(finals[field])
    has_numbers = is_number(finals[field])
    has_few_values = not has_numbers or len(distinct) <= MAX_GROUPS
    if finals.attrs["design"] == "grid" or has_few_values:
        # One group per value.
        positions = distinct if has_numbers else range(len(distinct))
        return [
            Group(label, float(position), np.flatnonzero(values == value))
            for label, position, value in zip(
                format_levels(distinct), positions, distinct, strict=True
            )
        ]
    n_groups = min(MAX_GROUPS, max(MIN_GROUPS, values.size // MIN_GROUP_POINTS))
    inner_quantiles = np.linspace(0, 1, n_groups + 1)[1:-1]  # Without 0 and 1.
    edges = np.quantile(values, inner_quantiles)
    group_indices = np.searchsorted(edges, values, side="right")
    groups = []
    for group_index in np.unique(group_indices):
        points = np.flatnonzero(group_indices == group_index)
        selected = values[points]
        label = " to ".join(format_levels([selected.min().item(), selected.max().item()]))
        groups.append(Group(label, float(np.median(selected)), points))
    return groups


def compute_responses(finals: xr.Dataset, field: str, measure: str) -> list[Response]:
    """Return the response of a measure by group of a field, averaged over all other fields."""
    sample_dim, averaged_dim = ("point", "run") if is_sampled(finals) else ("run", "point")
    responses = []
    for group in group_points(finals, field):
        values = finals[measure].isel(point=group.points).mean(averaged_dim)
        numbers = map(float, interval_of_mean(values, sample_dim))  # Mean, low and high.
        responses.append(
            Response(field, group.label, group.position, measure, len(group.points), *numbers)
        )
    return responses


def list_pairs(sweep: xr.Dataset) -> list[tuple[str, str]]:
    """Return the pairs of fields of a grid that both have several values."""
    if sweep.attrs["design"] != "grid":
        return []
    fields = [field for field in sweep.attrs["fields"] if np.unique(sweep[field].values).size > 1]
    return list(combinations(fields, r=2))


def compute_table(
    finals: xr.Dataset, row: str, column: str, measure: str
) -> npt.NDArray[np.float64]:
    """Return means over runs and all other fields, [group of `row`, group of `column`].

    `measure`: "best", "mean" or "share". The groups have the order of `group_points`.
    """
    means = finals[measure].mean("run").values
    column_groups = group_points(finals, column)
    table = []
    for row_group in group_points(finals, row):
        points_by_column = [
            np.intersect1d(row_group.points, group.points) for group in column_groups
        ]
        table.append([_finite_mean(means[points]) for points in points_by_column])
    return np.array(table)


def _finite_mean(values: npt.NDArray[np.float64]) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else nan


def compute_correlations(finals: xr.Dataset) -> list[Correlation]:
    """Return correlations of numeric fields with measures, NaN for constants or under 3 points."""
    correlations = []
    for field in finals.attrs["fields"]:
        if is_number(finals[field]):
            for measure in fitness.MEASURES:
                means = finals[measure].mean("run").dropna("point")
                rho, p = _spearman(means[field].values, means.values)
                correlations.append(Correlation(field, measure, means.size, rho, p))
    # The corrected p-values of the defined correlations, in their order.
    corrected = iter(statistics.holm([item.p for item in correlations if not isnan(item.p)]))
    return [
        item if isnan(item.p) else item._replace(p_holm=float(next(corrected)))
        for item in correlations
    ]


def _spearman(values: npt.NDArray[Any], means: npt.NDArray[np.float64]) -> tuple[float, float]:
    """Return the correlation of values with means [point], and the p-value."""
    is_constant = np.unique(values).size == 1 or np.unique(means).size == 1
    if values.size < MIN_CORRELATED_POINTS or is_constant:
        return nan, nan
    result = stats.spearmanr(values, means)
    return float(result.statistic), float(result.pvalue)


def tabulate_points(finals: xr.Dataset) -> list[dict[str, Any]]:
    """Return a row per point and measure with the keys "point", fields and `RESPONSE_COLUMNS`."""
    fields = finals.attrs["fields"]
    intervals = {measure: interval_of_mean(finals[measure]) for measure in fitness.MEASURES}
    n_runs = finals["mean"].count("run").values
    rows = []
    for point_index, point in enumerate(finals["point"].values.tolist()):
        settings = {field: finals[field].values[point_index].item() for field in fields}
        for measure, interval in intervals.items():
            numbers = (float(values[point_index]) for values in interval)
            response = (measure, int(n_runs[point_index]), *numbers)
            row = dict(zip(RESPONSE_COLUMNS, response, strict=True))
            rows.append({"point": point, **settings, **row})
    return rows


def write_responses(finals: xr.Dataset, directory: Path) -> None:
    """Write `responses.csv`, with one row per point and measure, atomically."""
    columns = ("point", *finals.attrs["fields"], *RESPONSE_COLUMNS)
    write_atomically(directory / "responses.csv", to_csv(columns, tabulate_points(finals)))
