"""Reaction norms as they are shown: fitness at each value of a circumstance, those of one map together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.assays.values import conditions, factors_of
from baldwinlab.core.variables import AS_EVOLVED
from baldwinlab.experiment.paths import name_of


class Panel(NamedTuple):
    """One circumstance on one map."""

    field: str  # the path of what is changed, "map" for the whole world
    name: str  # of that, in words
    map: str  # that the conditions evolved on
    values: tuple[str, ...]  # what the field is, in order
    evolved: frozenset[str]  # those values that any of them evolved with
    norms: Mapping[
        str, xr.DataArray
    ]  # by condition, fitness (run, place): its places are those of its values among `values`

    @property
    def labels(self) -> list[str]:
        """The values; in parentheses those that were evolved with."""
        return [f"({value})" if value in self.evolved else value for value in self.values]


def by_circumstance(stored: Mapping[str, xr.Dataset]) -> list[Panel]:
    """Of the stored assays `reaction`, by condition: field by field, each on every map."""
    typed = conditions({"reaction": stored})
    experiments = {name: experiment.to_dict() for name, experiment in typed.items()}
    maps = {name: factors_of(data).map for name, data in stored.items()}

    def panel(field: str, map_name: str) -> Panel:
        shown = [name for name in stored if maps[name] == map_name]
        base = {name: _as_evolved(map_name, experiments[name], field) for name in shown}
        found = {name: _norm(stored[name], field, base[name]) for name in shown}
        values = tuple(sorted({value for norm in found.values() for value in norm}, key=_number))
        norms = {name: _along(norm, values) for name, norm in found.items() if norm}
        return Panel(
            field,
            name_of(field, *typed.values()),
            map_name,
            values,
            frozenset(base.values()),
            norms,
        )

    fields = dict.fromkeys(
        str(field)
        for data in stored.values()
        for field in data["field"].values
        if field != AS_EVOLVED
    )
    return [panel(field, map_name) for field in fields for map_name in dict.fromkeys(maps.values())]


def _as_evolved(map_name: str, experiment: Mapping[str, object], field: str) -> str:
    """The value of a field that a condition evolved with, as the assay writes values."""
    if field == "map":
        return map_name
    value: object = experiment
    for step in field.split("."):
        value = (
            value[int(step)]
            if isinstance(value, list)
            else value[step]
            if isinstance(value, dict)
            else None
        )
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _norm(data: xr.Dataset, field: str, as_evolved: str) -> dict[str, xr.DataArray]:
    """Fitness (run) at each value of a field, the one it evolved with among them; nothing where the field was not varied."""
    food = data["energy"].mean("agent")
    found = {}
    for number, (name, value) in enumerate(
        zip(data["field"].values, data["value"].values, strict=True)
    ):
        if name in (field, AS_EVOLVED):
            found[as_evolved if name == AS_EVOLVED else str(value)] = food.isel(setting=number)
    return found if len(found) > 1 else {}


def _number(value: str) -> tuple[float, str]:
    try:
        return float(value), value
    except ValueError:
        return 0.0, value


def _along(norm: Mapping[str, xr.DataArray], values: tuple[str, ...]) -> xr.DataArray:
    shown = [value for value in values if value in norm]
    food = xr.concat(
        [norm[value].drop_vars(["field", "value", "setting"], errors="ignore") for value in shown],
        "place",
    )
    return food.assign_coords(place=np.array([values.index(value) for value in shown]))
