"""Each condition by itself: the spread over runs of what it achieved at last."""

from __future__ import annotations

from typing import NamedTuple

import xarray as xr

from baldwinlab.analysis import fitness, statistics


class Row(NamedTuple):
    condition: str
    measure: str
    n: int
    median: float
    mean: float
    lower_quartile: float
    upper_quartile: float
    min: float
    max: float


SUMMARY_COLUMNS = Row._fields


def by_condition(study: xr.Dataset, last: int = 10) -> list[Row]:
    """A row for each condition and measure (best, mean, share), over the runs that there are; none where there are none.

    Each run counts with its average over the last `last` generations. Raises ValueError unless `last` is at least 1.
    """
    finals = {measure: fitness.final(study, measure, last) for measure in fitness.MEASURES}
    rows = []
    for condition in study["condition"].values:
        for measure, values in finals.items():
            sample = values.sel(condition=condition).dropna("run").values
            if sample.size:
                rows.append(Row(str(condition), measure, *statistics.summarise(sample)))
    return rows
