"""Each condition by itself: the spread over runs of what it achieved at last."""

from __future__ import annotations

from typing import Any

import xarray as xr

from baldwinlab import statistics
from baldwinlab.statistics import fitness

SUMMARY_COLUMNS = ("condition", "measure", *statistics.Summary._fields)


def by_condition(study: xr.Dataset, last: int = 10) -> list[dict[str, Any]]:
    """A row for each condition and measure (best, mean, share), over the runs that there are; none where there are none.

    Each run counts with its average over the last `last` generations. Raises ValueError unless `last` is at least 1.
    """
    finals = {measure: fitness.final(study, measure, last) for measure in fitness.MEASURES}
    rows = []
    for condition in study["condition"].values:
        for measure, values in finals.items():
            sample = values.sel(condition=condition).dropna("run").values
            if sample.size:
                rows.append(
                    {
                        "condition": str(condition),
                        "measure": measure,
                        **statistics.summarise(sample)._asdict(),
                    }
                )
    return rows
