"""How what a population achieves at last responds to the fields of a sweep.

A sweep comes as `baldwinlab.open_sweep` gives it. In each run a point counts with its average over the last generations. In a
grid or a list, runs are what is sampled: the interval is that of the mean over runs, each run averaged over the points that
share a value. In a random or a Sobol sample, points are: the interval is that of the mean over points, each averaged over
its runs.

Source: C. Spearman, American Journal of Psychology 15 (1904), for the rank correlation.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy import stats

from baldwinlab.analysis import statistics
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.csv import to_csv
from baldwinlab.analysis.statistics.fitness import interval_of_mean
from baldwinlab.core.files import write_atomically

MOST_GROUPS = 8
POINTS_IN_A_GROUP = 5  # at least, where values are put together


class Group(NamedTuple):
    """Points that share a value of a field, or have neighbouring ones."""

    label: str
    position: (
        float  # on the field's axis: the value, or the median of several; for texts, their number
    )
    points: npt.NDArray[np.intp]


class Response(NamedTuple):
    """A measure over a group of points; NaN where a number does not exist."""

    field: str
    group: str
    position: float
    measure: str
    points: int
    mean: float
    low: float  # 95 % interval of the mean
    high: float


class Correlation(NamedTuple):
    field: str
    measure: str
    points: int
    rho: float  # Spearman's, of the field and the points' means over runs
    p: float  # two-sided, by Student's t
    p_holm: float  # corrected for all fields and measures


def finals(sweep: xr.Dataset, last: int = 10) -> xr.Dataset:
    """`best`, `mean` and `share` averaged over the last `last` generations: (point, run), with the fields along `point`.

    Raises ValueError unless `last` is at least 1.
    """
    finals = {measure: fitness.final(sweep, measure, last) for measure in fitness.MEASURES}
    measured = xr.Dataset(finals, attrs=sweep.attrs | {"food": "food_eaten" in sweep})
    if "point" not in measured.dims:
        fields = sweep.attrs["fields"]
        meanings = {field: dict(sweep[field].attrs) for field in fields}
        measured = measured.stack(corner=fields).reset_index("corner").rename(corner="point")
        measured = measured.assign_coords(point=np.arange(measured.sizes["point"]))
        for field in fields:
            measured[field].attrs = meanings[field]
    return measured.transpose("point", "run")


def is_sampled(sweep: xr.Dataset) -> bool:
    """Whether the points are a random or a Sobol sample."""
    return sweep.attrs["design"] in ("random", "sobol")


def is_number(values: xr.DataArray) -> bool:
    return bool(np.issubdtype(values.dtype, np.number))


def label(value: Any) -> str:
    return (
        value
        if isinstance(value, str)
        else f"{value:.4g}"
        if isinstance(value, float)
        else f"{value}"
    )


def groups(measured: xr.Dataset, field: str) -> list[Group]:
    """The points by their value of a field, numbers ascending.

    Where a sample or a list has more than eight different numbers, they are put together by quantiles: in up to eight groups, of
    about as many points, at least five.
    """
    values = measured[field].values
    distinct = (
        np.unique(values).tolist()
        if is_number(measured[field])
        else list(dict.fromkeys(values.tolist()))
    )
    if (
        measured.attrs["design"] == "grid"
        or not is_number(measured[field])
        or len(distinct) <= MOST_GROUPS
    ):
        places = distinct if is_number(measured[field]) else range(len(distinct))
        return [
            Group(label(value), float(place), np.flatnonzero(values == value))
            for value, place in zip(distinct, places, strict=True)
        ]
    number = min(MOST_GROUPS, max(2, values.size // POINTS_IN_A_GROUP))
    edges = np.quantile(values, np.linspace(0, 1, number + 1)[1:-1])
    group_of = np.searchsorted(edges, values, side="right")
    found = [np.flatnonzero(group_of == group) for group in np.unique(group_of)]
    return [
        Group(
            f"{label(values[points].min())} to {label(values[points].max())}",
            float(np.median(values[points])),
            points,
        )
        for points in found
    ]


def responses(measured: xr.Dataset, field: str, measure: str) -> list[Response]:
    """The measure along one field, averaged over all others: one entry for each of the field's `groups`."""
    over, averaged = ("point", "run") if is_sampled(measured) else ("run", "point")
    found = []
    for group in groups(measured, field):
        values = measured[measure].isel(point=group.points)
        average, low, high = (
            float(number) for number in interval_of_mean(values.mean(averaged), over)
        )
        found.append(
            Response(
                field, group.label, group.position, measure, len(group.points), average, low, high
            )
        )
    return found


def pairs(sweep: xr.Dataset) -> list[tuple[str, str]]:
    """The pairs of fields of a grid that both have several values: those that a table can show."""
    fields = [field for field in sweep.attrs["fields"] if np.unique(sweep[field].values).size > 1]
    return list(combinations(fields, 2)) if sweep.attrs["design"] == "grid" else []


def table(measured: xr.Dataset, row: str, column: str, measure: str) -> npt.NDArray[np.float64]:
    """Means over runs and all other fields: [value of `row`, value of `column`], in the order of `groups`."""
    means = measured[measure].mean("run").values
    return np.array(
        [
            [
                _mean(means[np.intersect1d(down.points, across.points)])
                for across in groups(measured, column)
            ]
            for down in groups(measured, row)
        ]
    )


def _mean(values: npt.NDArray[np.float64]) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else nan


def correlations(measured: xr.Dataset) -> list[Correlation]:
    """Spearman's rank correlation of each measure with each field that is a number; NaN where either does not vary."""
    found = []
    for field in measured.attrs["fields"]:
        if is_number(measured[field]):
            for measure in fitness.MEASURES:
                means = measured[measure].mean("run").dropna("point")
                found.append(
                    Correlation(
                        field,
                        measure,
                        means.size,
                        *_spearman(means[field].values, means.values),
                        nan,
                    )
                )
    known = [correlation for correlation in found if not np.isnan(correlation.p)]
    corrected = iter(statistics.holm([correlation.p for correlation in known]).tolist())
    return [one if np.isnan(one.p) else one._replace(p_holm=next(corrected)) for one in found]


def _spearman(values: npt.NDArray[Any], means: npt.NDArray[np.float64]) -> tuple[float, float]:
    if values.size < 3 or np.unique(values).size == 1 or np.unique(means).size == 1:
        return nan, nan
    result = stats.spearmanr(values, means)
    return float(result.statistic), float(result.pvalue)


def by_point(measured: xr.Dataset) -> list[dict[str, Any]]:
    """A row for each point and measure: the fields, the runs there are, the mean over them and its 95 % interval."""
    fields = measured.attrs["fields"]
    intervals = {measure: interval_of_mean(measured[measure]) for measure in fitness.MEASURES}
    counts = measured["mean"].count("run").values
    rows = []
    for point, number in enumerate(measured["point"].values.tolist()):
        settings = {field: measured[field].values[point].item() for field in fields}
        for measure, numbers in intervals.items():
            average, low, high = (float(values[point]) for values in numbers)
            found = {
                "measure": measure,
                "runs": int(counts[point]),
                "mean": average,
                "low": low,
                "high": high,
            }
            rows.append({"point": number, **settings, **found})
    return rows


def write(measured: xr.Dataset, directory: Path) -> None:
    """Write `responses.csv`, a row for each point and measure, whole or not at all. Raises OSError."""
    columns: Sequence[str] = (
        "point",
        *measured.attrs["fields"],
        "measure",
        "runs",
        "mean",
        "low",
        "high",
    )
    write_atomically(directory / "responses.csv", to_csv(columns, by_point(measured)))
