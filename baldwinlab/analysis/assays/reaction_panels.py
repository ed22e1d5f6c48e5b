"""Reaction norms: fitness by the value of a setting, in one panel per setting and world."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.assays.evaluation import parse_experiments, read_factors
from baldwinlab.experiment.paths import short_name

# Stored name of the settings with which the condition evolved.
UNCHANGED_SETTING: Final = "as evolved"


class ReactionPanel(NamedTuple):
    """Reaction norms of one setting in one world."""

    # Path of the setting, or "map" for the map itself.
    field: str
    # Name of the setting, for labels.
    name: str
    # The map and the world in which the conditions evolved. Models without maps have the map "".
    map: str
    world: str
    # The values of the setting, in order.
    values: tuple[str, ...]
    # The values with which the conditions evolved.
    evolved: frozenset[str]
    # Fitness (run, position) by condition, where a position is an index of `values`.
    norms: Mapping[str, xr.DataArray]

    @property
    def labels(self) -> list[str]:
        """The values. The values with which conditions evolved are in parentheses."""
        return [f"({value})" if value in self.evolved else value for value in self.values]


def make_reaction_panels(stored: Mapping[str, xr.Dataset]) -> list[ReactionPanel]:
    """Return the reaction norms of all settings in all worlds."""
    experiments = parse_experiments({"reaction": stored})
    trees = {name: experiment.to_dict() for name, experiment in experiments.items()}
    factors = {name: read_factors(data) for name, data in stored.items()}
    worlds = {name: (levels.map, levels.world) for name, levels in factors.items()}

    def make_panel(field: str, map_name: str, world: str) -> ReactionPanel:
        names = [name for name in stored if worlds[name] == (map_name, world)]
        evolved = {name: _find_evolved_value(map_name, trees[name], field) for name in names}
        norms = {name: _read_norm(stored[name], field, evolved[name]) for name in names}
        distinct_values = {value for norm in norms.values() for value in norm}
        values = tuple(sorted(distinct_values, key=_rank_value))
        return ReactionPanel(
            field=field,
            name=short_name(field, *experiments.values()),
            map=map_name,
            world=world,
            values=values,
            evolved=frozenset(evolved.values()),
            norms={name: _align(norm, values) for name, norm in norms.items() if norm},
        )

    fields = dict.fromkeys(
        str(field)
        for data in stored.values()
        for field in data["field"].values
        if field != UNCHANGED_SETTING
    )
    distinct_worlds = dict.fromkeys(worlds.values())
    return [make_panel(field, *world) for field in fields for world in distinct_worlds]


def _find_evolved_value(map_name: str, experiment: Mapping[str, object], field: str) -> str:
    """Return the value of a setting during evolution, in the format of the assay."""
    if field == "map":
        return map_name
    value: object = experiment
    for key in field.split("."):
        # The key of an item of a list is its index.
        value = _get_setting(value, key)
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _get_setting(value: object, key: str) -> object:
    if isinstance(value, list):
        return value[int(key)]
    return value[key] if isinstance(value, dict) else None


def _read_norm(data: xr.Dataset, field: str, evolved: str) -> dict[str, xr.DataArray]:
    """Return fitness (run) by value of a setting. It is empty if the setting was not varied."""
    fitness = data["energy"].mean("agent")
    norm = {}
    settings = zip(data["field"].values, data["value"].values, strict=True)
    for setting_index, (name, value) in enumerate(settings):
        if name in (field, UNCHANGED_SETTING):
            label = evolved if name == UNCHANGED_SETTING else str(value)
            norm[label] = fitness.isel(setting=setting_index)
    return norm if len(norm) > 1 else {}


def _rank_value(value: str) -> tuple[float, str]:
    """Return the sort key of a value. Texts are sorted like the number 0, then by the alphabet."""
    try:
        return float(value), value
    except ValueError:
        return 0.0, value


def _align(norm: Mapping[str, xr.DataArray], values: tuple[str, ...]) -> xr.DataArray:
    """Return a norm along the dimension `position`, the index of a value in `values`."""
    measured_values = [value for value in values if value in norm]
    columns = [
        norm[value].drop_vars(["field", "value", "setting"], errors="ignore")
        for value in measured_values
    ]
    positions = np.array([values.index(value) for value in measured_values])
    return xr.concat(columns, "position").assign_coords(position=positions)
