"""Data of the figures of a report: tables, names and commands."""

from __future__ import annotations

from typing import Any

import xarray as xr

from baldwinlab.analysis.report.phrases import format_number
from baldwinlab.analysis.statistics import curve_intervals, fitness


def tabulate_generations(data: xr.Dataset, measure: str) -> list[dict[str, Any]]:
    """Return the mean over runs and its interval: one row per condition and generation."""
    average, low, high = curve_intervals.interval_of_mean(fitness.MEASURES[measure](data))
    numbers = xr.Dataset({"mean": average, "low": low, "high": high})[["mean", "low", "high"]]
    table = numbers.reset_coords(drop=True).to_dataframe().dropna(how="all").reset_index()
    return [
        {"condition": row.pop("condition"), "measure": measure, **row}
        for row in table.to_dict("records")
    ]


def list_typical_replays(data: xr.Dataset) -> list[str]:
    """Return the commands that replay the last generation of a typical run of each condition."""
    if "food_eaten" not in data:
        return []
    has_data = data["energy"].notnull().any(("run", "agent"))
    commands = []
    for name in map(str, data["condition"].values):
        is_stored = has_data.sel(condition=name)
        if bool(is_stored.any()):
            last_generation = int(is_stored["generation"][is_stored][-1])
            run = fitness.typical_run(data, name)
            commands.append(format_replay_command(name, run, last_generation))
    return commands


def name_fitness(data: xr.Dataset, *agents: str) -> str:
    """Return the name of fitness, for example "Energy of the items eaten by the best agent"."""
    gain = str(data["energy"].attrs.get("long_name", "fitness"))
    # The text of earlier versions ends differently.
    if "energy of the items" in gain:
        names = " and by ".join(f"the {agent} agent" for agent in agents)
        return f"Energy of the items eaten by {names}"
    names = " and of ".join(f"the {agent} agent" for agent in agents)
    return f"{gain[0].upper()}{gain[1:]} of {names}"


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
    return f"Final fitness of the average agent, median over runs: {', '.join(values)}."


def format_replay_command(condition: str, run: int, generation: int) -> str:
    """Return the command that replays a lifetime of the study."""
    return (
        f"baldwinlab replay . --condition {condition} --run {run} --generation {generation} "
        "--out life.mp4"
    )
