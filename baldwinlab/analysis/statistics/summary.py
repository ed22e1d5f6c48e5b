"""Summarize the final fitness of each condition over its runs."""

from __future__ import annotations

from typing import Any

import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.statistics import fitness

SUMMARY_COLUMNS = ("condition", "measure", *statistics.Summary._fields)


def summarize_conditions(dataset: xr.Dataset, last: int = 10) -> list[dict[str, Any]]:
    """Summarize best, mean and share of the last generations for each condition that has runs.

    The result has one row per condition and measure, with the keys `SUMMARY_COLUMNS`.
    """
    finals = {measure: fitness.final(dataset, measure, last) for measure in fitness.MEASURES}
    rows = []
    for condition in dataset["condition"].values:
        for measure, values in finals.items():
            sample = values.sel(condition=condition).dropna("run").values
            if sample.size:
                row = {"condition": str(condition), "measure": measure}
                rows.append(row | statistics.summarize(sample)._asdict())
    return rows
