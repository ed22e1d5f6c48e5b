"""Stored assays read back, and what they measured as one value a run.

An assay's dataset is declared in `baldwinlab.core.variables.ASSAYS`. A run counts with the average over its agents and, where there
are generations, over a window of its first or last ones. Food is the energy of the items eaten in a life.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import xarray as xr

from baldwinlab.core.variables import AS_EVOLVED, EVOLVED, LIVES, NEWBORNS, RANDOM
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import Factors
from baldwinlab.experiment.toml import from_toml

Assays = Mapping[str, Mapping[str, xr.Dataset]]  # by assay and condition
Quantity = tuple[
    str, str
]  # what was measured, and when or of whom: ("off", "last"), ("first meal", "random genome")
Values = tuple[Quantity, xr.DataArray]  # a quantity, one value a run


def conditions(assays: Assays) -> dict[str, Experiment]:
    """The experiment of every condition that any assay has, in their order."""
    found = {name: data for stored in assays.values() for name, data in stored.items()}
    return {
        name: from_toml(data.attrs["experiment"], where=f"the experiment of {name}", lenient=True)
        for name, data in found.items()
    }


def factors_of(data: xr.Dataset) -> Factors:
    """Those of the condition that an assay was made of."""
    return Factors(*(data.attrs[name] for name in Factors._fields))


def lives(innate: xr.Dataset) -> xr.DataArray:
    """Food of the average agent (run, generation, life), with every kind of life; NaN where it was not lived."""
    return innate["energy"].mean("agent").reindex(life=list(LIVES))


def distances(innate: xr.Dataset) -> dict[str, xr.DataArray]:
    """How far learning moved the average agent's weights, all of them and those of each layer: (run, generation)."""
    if "distance" not in innate:
        return {}
    moved = innate["distance"]
    together = (moved**2).sum("layer", min_count=1) ** 0.5
    layers = {
        f"distance, {layer}": moved.sel(layer=layer).mean("agent")
        for layer in moved["layer"].values
    }
    return {"distance": together.mean("agent"), **layers}


def share(part: xr.DataArray, whole: xr.DataArray) -> xr.DataArray:
    """Return part / whole, or NaN where the whole is 0."""
    return part / whole.where(whole > 0)


def lifetime(within_life: xr.Dataset) -> int:
    """Steps in a life."""
    return from_toml(
        within_life.attrs["experiment"], where="the assay", lenient=True
    ).lifetime.steps


def evolved(within_life: xr.Dataset) -> str:
    """The newborns of the latest generation that was assayed; empty where there are none."""
    generations = [str(name) for name in within_life["newborns"].values if name != RANDOM]
    return max(generations, key=lambda name: int(name.split()[-1]), default="")


def quantities(assays: Assays, condition: str, last: int) -> dict[Quantity, xr.DataArray]:
    """Everything the stored assays say of a condition: one value a run (dimension `run`), NaN where it is undefined.

    "first" and "last" are windows of `last` generations, "throughout" is all of them.
    Raises ValueError unless `last` is at least 1.
    """
    if last < 1:
        raise ValueError(f"a window of {last} generations: it must have at least 1")
    stored = {
        assay: assays[assay][condition]
        for assay in _QUANTITIES
        if condition in assays.get(assay, {})
    }
    return {
        quantity: values
        for assay, data in stored.items()
        for quantity, values in _QUANTITIES[assay](data, last)
    }


def _windows(values: xr.DataArray, last: int) -> dict[str, xr.DataArray]:
    generation = values["generation"].astype(
        np.int64
    )  # as stored, it could not be compared with a very large `last`
    return {
        "first": values.where(generation < generation.min() + last, drop=True),
        "last": values.where(generation > generation.max() - last, drop=True),
        "throughout": values,
    }


def _innate(data: xr.Dataset, last: int) -> Iterator[Values]:
    for when, part in _windows(lives(data), last).items():
        life = {name: part.sel(life=name) for name in LIVES}
        average = {name: values.mean("generation") for name, values in life.items()}
        for name, values in average.items():
            yield (name, when), values
        yield (
            ("on, where drift was lived", when),
            life["on"].where(life["drift"].notnull()).mean("generation"),
        )
        yield ("gain", when), average["on"] - average["off"]
        yield ("innate share", when), share(average["off"], average["on"])
        yield ("kept share", when), share(average["frozen"], average["on"])
    for name, values in distances(data).items():
        for when, part in _windows(values, last).items():
            yield (name, when), part.mean("generation")


def _neutral(data: xr.Dataset, last: int) -> Iterator[Values]:
    energy = _windows(data["energy"], last)["last"].mean(("agent", "generation"))
    for who in NEWBORNS:
        off, on = (energy.sel(newborns=who, life=life) for life in ("off", "on"))
        yield ("off, beside the neutral twin", who), off
        yield ("on, beside the neutral twin", who), on
        yield ("gain, beside the neutral twin", who), on - off


def _within_life(data: xr.Dataset, last: int) -> Iterator[Values]:
    steps = lifetime(data)
    for who, name in ((RANDOM, RANDOM), (EVOLVED, evolved(data))):
        if name not in data["newborns"].values:
            continue
        newborns = data.sel(newborns=name)
        eaten = newborns["eaten_in_window"].mean("agent")
        lived = eaten.notnull().all("window")
        yield ("eaten in life", who), eaten.sum("window").where(lived)
        yield ("eaten in the first part of life", who), eaten.isel(window=0)
        yield ("eaten in the last part of life", who), eaten.isel(window=-1)
        yield ("first meal", who), newborns["first_meal"].fillna(steps).mean("agent").where(lived)
        yield ("ever ate", who), newborns["first_meal"].notnull().mean("agent").where(lived)


def _modules(data: xr.Dataset, last: int) -> Iterator[Values]:
    for name in data["modules"].values:
        yield ("modules", str(name)), data["energy"].sel(modules=name).mean("agent")


def _reaction(data: xr.Dataset, last: int) -> Iterator[Values]:
    food = data["energy"].mean("agent")
    names = [
        setting_name(*pair) for pair in zip(data["field"].values, data["value"].values, strict=True)
    ]
    base = food.isel(setting=names.index(AS_EVOLVED)) if AS_EVOLVED in names else None
    for number, name in enumerate(names):
        yield ("setting", name), food.isel(setting=number)
        if base is not None and name != AS_EVOLVED:
            yield ("setting, relative", name), share(food.isel(setting=number), base)


def setting_name(field: str, value: str) -> str:
    return AS_EVOLVED if field == AS_EVOLVED else f"{field} = {value}"


def _descent(data: xr.Dataset, last: int) -> Iterator[Values]:
    for name in ("common_ancestor_age", "effective_ancestors"):
        yield (name.replace("_", " "), "last"), data[name].isel(generation=-1)


_QUANTITIES: Mapping[str, Callable[[xr.Dataset, int], Iterator[Values]]] = {
    "innate": _innate,
    "neutral": _neutral,
    "within-life": _within_life,
    "modules": _modules,
    "reaction": _reaction,
    "descent": _descent,
}
