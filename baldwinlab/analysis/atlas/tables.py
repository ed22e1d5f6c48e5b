"""Means, slopes and correlations with intervals, and tables with one row per cell and outcome.

References
----------
Mean over crossed random effects: H. H. Clark, Journal of Verbal Learning and Verbal Behavior 12
(1973). Degrees of freedom: F. E. Satterthwaite, Biometrics Bulletin 2 (1946). Intervals of rank
correlations: E. C. Fieller, H. O. Hartley and E. S. Pearson, Biometrika 44 (1957).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy import stats

from baldwinlab.analysis.atlas.laws import Law
from baldwinlab.analysis.atlas.outcomes import OUTCOMES
from baldwinlab.analysis.results.numbers import (
    finite_or_none,
    format_estimate,
    format_percentage,
    replace_undefined,
)
from baldwinlab.analysis.statistics.bootstrap import CONFIDENCE_LEVEL

Floats = npt.NDArray[np.float64]
RESIDUAL: Final = "residual"
CORRELATIONS: Final[Mapping[str, tuple[Any, float, int]]] = {
    "spearman": (stats.spearmanr, 1.06, 3),
    "kendall": (stats.kendalltau, 0.437, 4),
}


class MeanInterval(NamedTuple):
    """A mean over runs, or another estimate, with its 95 % interval.

    The interval is NaN for a single run. `runs` counts the defined values.
    """

    mean: float
    low: float
    high: float
    runs: int

    def __str__(self) -> str:
        if not self.runs:
            return "not defined"
        return format_estimate(self.mean, self.low, self.high, digits=3)


def estimate_mean(values: xr.DataArray | Floats, level: float = CONFIDENCE_LEVEL) -> MeanInterval:
    """Return the mean of the defined values of runs, with its interval (Student's t)."""
    defined = np.asarray(values, np.float64).ravel()
    defined = defined[np.isfinite(defined)]
    if not defined.size:
        return MeanInterval(np.nan, np.nan, np.nan, 0)
    mean = float(defined.mean())
    if defined.size == 1:
        return MeanInterval(mean, np.nan, np.nan, 1)
    error = defined.std(ddof=1) / np.sqrt(defined.size)
    half = float(error * stats.t.ppf((1 + level) / 2, defined.size - 1))
    return MeanInterval(mean, mean - half, mean + half, defined.size)


def estimate_slope(x: Floats, values: xr.DataArray, dim: str) -> MeanInterval:
    """Return the mean over runs of the least-squares slope of values (dim, run) on x."""
    centered = xr.DataArray(x - x.mean(), dims=dim)
    slopes = (values.drop_vars(dim, errors="ignore") * centered).sum(dim, skipna=False)
    return estimate_mean(slopes / float((centered**2).sum()))


def pool_cells(values: xr.DataArray) -> MeanInterval:
    """Return the mean over cells and runs, with its interval for other cells and other runs.

    Cells and runs are crossed random effects, because all cells of a run use its random numbers.
    Without an effect of the runs, the interval is that of Student's t for the means of the cells.
    A cell with an undefined run is left out. The interval is NaN for a single cell or run.
    """
    dims = [dim for dim in values.dims if dim != "run"]
    table = values.stack(cell=dims).dropna("cell").transpose("cell", "run").values
    n_cells, n_runs = table.shape
    if min(n_cells, n_runs) < 2:
        return estimate_mean(table)._replace(low=np.nan, high=np.nan)
    mean = float(table.mean())
    of_cells, of_runs = table.mean(axis=1), table.mean(axis=0)
    rest = table - of_cells[:, None] - of_runs + mean
    degrees = np.array([n_cells - 1, n_runs - 1, (n_cells - 1) * (n_runs - 1)])
    sums = (n_runs * (of_cells - mean) ** 2, n_cells * (of_runs - mean) ** 2, rest**2)
    squares = np.array([values.sum() for values in sums]) / degrees
    # No variance component is below 0.
    total = max(squares[0], squares[1], squares[0] + squares[1] - squares[2])
    if total == 0:
        return MeanInterval(mean, mean, mean, n_runs)
    freedom = max(1.0, total**2 / float((squares**2 / degrees).sum()))
    error = np.sqrt(total / table.size)
    half = float(error * stats.t.ppf((1 + CONFIDENCE_LEVEL) / 2, freedom))
    return MeanInterval(mean, mean - half, mean + half, n_runs)


def estimate_correlation(x: Floats, y: Floats, method: str) -> MeanInterval:
    """Return Spearman's rank correlation, or Kendall's tau, of cells, with its interval.

    Fisher's transformation has the variance 1.06 / (n - 3) for Spearman, 0.437 / (n - 4) for tau.
    """
    correlate, variance, lost = CORRELATIONS[method]
    correlation, size = float(correlate(x, y).statistic), x.size - lost
    if size < 1:
        return MeanInterval(correlation, np.nan, np.nan, 1)
    # A correlation of 1 has no transformation.
    center = np.arctanh(np.clip(correlation, -1 + 1e-12, 1 - 1e-12))
    half = stats.norm.ppf((1 + CONFIDENCE_LEVEL) / 2) * np.sqrt(variance / size)
    low, high = np.tanh([center - half, center + half]).tolist()
    return MeanInterval(correlation, low, high, 1)


def is_equivalent(differences: xr.DataArray | Floats, bound: float) -> bool:
    """Return whether two one-sided t tests at 5 % show that the mean is within `bound` of 0."""
    defined = np.asarray(differences, np.float64).ravel()
    defined = defined[np.isfinite(defined)]
    if defined.size < 2:
        return False
    # All differences are 0, so that the t test is undefined.
    if not defined.any():
        return bound > 0
    tests = (
        stats.ttest_1samp(defined, bound, alternative="less"),
        stats.ttest_1samp(defined, -bound, alternative="greater"),
    )
    return all(float(test.pvalue) < 1 - CONFIDENCE_LEVEL for test in tests)


def format_fall(fall: float) -> str:
    """Return a difference of log(d_first / d_last) as a percentage: log(2) -> "+50 %"."""
    return format_percentage(1 - np.exp(-fall), "+") if np.isfinite(fall) else "–"


def list_cells(outcomes: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield the values of the swept fields of each cell, with the last field varying fastest."""
    fields = outcomes.attrs["fields"]
    for values in product(*(outcomes[field].values.tolist() for field in fields)):
        yield dict(zip(fields, values, strict=True))


def format_label(value: Any) -> str:
    """Return a value of a swept field for an axis or a table."""
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def describe_settings(cell: Mapping[str, Any], labels: Mapping[str, str]) -> str:
    """Return the settings of a cell for a caption.

    >>> describe_settings({"learning.rate": 0.10}, {"learning.rate": "learning rate"})
    'learning rate: 0.1'
    """
    return ", ".join(f"{labels[field]}: {format_label(value)}" for field, value in cell.items())


def tabulate(name: str, outcomes: xr.Dataset, law: Law | None) -> list[dict[str, Any]]:
    """Return a row per cell and outcome: the mean over runs with its 95 % interval.

    With a law, a further outcome "residual" is the measured quantity that the law predicts. The
    prediction is in the column "law".
    """
    values = {outcome: outcomes[outcome] for outcome in OUTCOMES}
    prediction = None
    if law is not None:
        values[RESIDUAL] = law.measured(outcomes)
        prediction = law.predict(outcomes).broadcast_like(values[RESIDUAL].isel(run=0, drop=True))
    rows = []
    for number, cell in enumerate(list_cells(outcomes)):
        settings = ", ".join(f"{field} = {value}" for field, value in cell.items())
        for outcome, array in values.items():
            interval = estimate_mean(array.sel(cell))
            rows.append(
                {
                    "map": name,
                    "cell": f"point-{number:04d}",
                    "settings": settings,
                    "outcome": outcome,
                    **replace_undefined(interval._asdict()),
                    "law": finite_or_none(float(prediction.sel(cell)))
                    if prediction is not None and outcome == RESIDUAL
                    else None,
                }
            )
    return rows
