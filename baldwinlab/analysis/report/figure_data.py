"""Data of the figures of a report: tables, names and commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import xarray as xr

from baldwinlab.analysis.figures import AgentKind, SensorSector
from baldwinlab.analysis.statistics import curve_intervals, fitness
from baldwinlab.analysis.statistics.numbers import format_number
from baldwinlab.experiment.miniworld_tables import World
from baldwinlab.experiment.outcome import capitalize, name_outcome_of


def tabulate_generations(data: xr.Dataset, measure: str) -> list[dict[str, Any]]:
    """Return the mean over runs and its interval: one row per condition and generation."""
    average, low, high = curve_intervals.interval_of_mean(fitness.MEASURES[measure](data))
    numbers = xr.Dataset({"mean": average, "low": low, "high": high})[["mean", "low", "high"]]
    table = numbers.reset_coords(drop=True).to_dataframe().dropna(how="all").reset_index()
    return [
        {"condition": row.pop("condition"), "measure": measure, **row}
        for row in table.to_dict("records")
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


def tabulate_evaluations(data: xr.Dataset, evaluation_variable: str) -> list[dict[str, Any]]:
    """Return the mean fitness and the total evaluations: one row per condition and generation."""
    per_generation = data[evaluation_variable].sum("agent", min_count=1)
    evaluations = per_generation.cumsum("generation").mean("run")
    numbers = xr.Dataset({"mean": fitness.mean(data).mean("run"), "evaluations": evaluations})
    table = numbers.reset_coords(drop=True).to_dataframe().dropna(subset="mean").reset_index()
    return [*table.to_dict("records")]


def tabulate_maps(worlds: Mapping[str, World]) -> list[dict[str, Any]]:
    """Return the areas of maps: one row per birth disc and per region of items."""
    rows: list[dict[str, Any]] = []
    for title, world in worlds.items():
        start = world.start
        size = {"map": title, "map_width": world.width, "map_height": world.height}
        edges = (start.x - start.radius, start.x + start.radius)
        heights = (start.y - start.radius, start.y + start.radius)
        areas = [("birth disc", edges, heights, 0)]
        areas += [("items", region.x, region.y, region.count) for region in world.food]
        for area, (left, right), (upper, lower), count in areas:
            sides = {"left": left, "right": right, "upper": upper, "lower": lower}
            rows.append(size | {"area": area} | sides | {"items": count})
    return rows


def tabulate_agents(kinds: Sequence[AgentKind]) -> list[dict[str, Any]]:
    """Return the networks of agents: one row per kind of agent and module."""
    return [
        {
            "agents": kind.name,
            "module": module,
            "inputs": " ".join(kind.inputs),
            "hidden_units": " ".join(map(str, kind.hidden)),
            "outputs": " ".join(kind.actions),
        }
        for kind in kinds
        for module in kind.modules
    ]


def tabulate_sectors(sectors: Mapping[SensorSector, Sequence[str]]) -> list[dict[str, Any]]:
    """Return the sectors of senses: one row per input."""
    return [
        {"input": name, **sector._asdict()} for sector, names in sectors.items() for name in names
    ]
