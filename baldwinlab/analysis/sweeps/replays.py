"""Lifetimes that the page of a sweep links to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from baldwinlab.analysis.report.replays import MAX_LINKED_LIVES, Link, StoredLife, make_link
from baldwinlab.analysis.statistics.contrast_table import SUMMARY_MEASURE
from baldwinlab.analysis.sweeps import analysis


def link_points(
    finals: xr.Dataset, conditions: Sequence[str], generations: Sequence[int]
) -> list[Link]:
    """Return links to the last generation of a typical run of points.

    Returns one link per point with runs. Of many points, only those with the lowest and the highest
    fitness of the average agent.
    """
    values = finals[SUMMARY_MEASURE]
    links = []
    for point in _select_points(values.mean("run").values):
        runs = values.isel(point=point).dropna("run")
        nearest = int(abs(runs - runs.median()).argmin("run"))
        life = StoredLife(conditions[point], int(runs["run"][nearest]), generations[point] - 1)
        links.append(make_link([life], _label_point(finals, point)))
    return links


def _select_points(means: np.ndarray) -> list[int]:
    """Return the linked points in their order. The mean of a point without runs is NaN."""
    measured = np.flatnonzero(np.isfinite(means))
    if len(measured) <= MAX_LINKED_LIVES:
        return measured.tolist()
    return sorted({int(np.nanargmin(means)), int(np.nanargmax(means))})


def _label_point(finals: xr.Dataset, point: int) -> str:
    values = finals.isel(point=point)
    fields = finals.attrs["fields"]
    return ", ".join(f"{field} = {analysis.format_value(values[field].item())}" for field in fields)
