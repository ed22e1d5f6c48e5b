"""Tables and texts that several figures of the report have."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.curve_intervals import interval_of_mean, tabulate_interval
from baldwinlab.analysis.statistics.numbers import format_number
from baldwinlab.experiment.outcome import capitalize, name_outcome_of


def tabulate_generations(data: xr.Dataset, measure: str) -> list[dict[str, Any]]:
    """Return the mean over runs and its interval: one row per condition and generation."""
    interval = interval_of_mean(fitness.MEASURES[measure](data))
    rows = tabulate_interval(interval, "mean")
    return [
        {"condition": row["condition"], "measure": measure, **row}
        for row in rows
        if np.isfinite(row["mean"])
    ]


def name_fitness(data: xr.Dataset, *agents: str) -> str:
    """Return the name of the outcome, for example "Items eaten by the best agent"."""
    name = name_outcome_of(fitness.outcome(data), " agent and the ".join(agents) + " agent")
    return capitalize(name)


def tabulate_runs(data: xr.Dataset, last: int) -> list[dict[str, Any]]:
    """Return the final fitness: one row per condition and finished run."""
    finals = {measure: fitness.final(data, measure, last) for measure in ("best", "mean")}
    table = xr.Dataset(finals).reset_coords(drop=True).to_dataframe()
    return [*table.dropna(how="all").reset_index().to_dict("records")]


def tabulate_shares(shares: xr.Dataset) -> list[dict[str, Any]]:
    """Return the mean share over runs: one row per condition, share and generation."""
    generations = shares["generation"].values
    rows = []
    for name, share in shares.items():
        for condition, values in share.mean("run").groupby("condition"):
            for generation, value in zip(generations, values.values.ravel(), strict=True):
                row = {"condition": str(condition), "share": str(name)}
                rows.append(row | {"generation": int(generation), "mean": float(value)})
    return rows


def describe_final_medians(data: xr.Dataset, last: int) -> str:
    """Return the median over runs of the final mean fitness, as alternative text of a figure."""
    medians = fitness.final(data, "mean", last).median("run")
    values = [
        f"{name} {format_number(float(medians.sel(condition=name)))}"
        for name in medians["condition"].values
    ]
    return f"{name_fitness(data, 'average')} at the end, median over runs: {', '.join(values)}."
