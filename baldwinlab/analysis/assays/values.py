"""Quantities of the stored assays, with one value per run.

`baldwinlab.core.assay_variables` declares the datasets of the assays. The value of a run is an
average over its agents and, if the assay has generations, over its first or last generations.
Fitness is the variable `energy`: for MiniWorld, the energy of the items that an agent eats.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

import numpy as np
import xarray as xr

from baldwinlab.analysis.assays import canalization, reaction_norms
from baldwinlab.analysis.assays.fork import compute_effects
from baldwinlab.core.assay_variables import (
    EVOLVED_NEWBORNS,
    LIFE_KINDS,
    NEUTRAL_NEWBORNS,
    RANDOM_NEWBORNS,
    UNCHANGED_SETTING,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.factors import Factors
from baldwinlab.experiment.toml import from_toml

# Datasets by assay and condition.
Assays = Mapping[str, Mapping[str, xr.Dataset]]
# A measure with its time or its agents, such as ("off", "last") or ("first meal", "evolved").
Quantity = tuple[str, str]
# A quantity with one value per run.
QuantityValues = tuple[Quantity, xr.DataArray]


def parse_experiments(assays: Assays) -> dict[str, Experiment]:
    """Return the experiment of every condition with a stored assay."""
    datasets = {name: data for stored in assays.values() for name, data in stored.items()}
    return {
        name: from_toml(data.attrs["experiment"], source=f"the experiment of {name}", lenient=True)
        for name, data in datasets.items()
    }


def read_factors(data: xr.Dataset) -> Factors:
    """Return the factors of the condition of an assay."""
    return Factors(*(data.attrs[name] for name in Factors._fields))


def mean_fitness(innate: xr.Dataset) -> xr.DataArray:
    """Return the fitness of the average agent in each kind of life.

    Returns fitness (run, generation, life), NaN for kinds of life that were not simulated.
    """
    return innate["energy"].mean("agent").reindex(life=list(LIFE_KINDS))


def weight_distances(innate: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return the distance between the weights at birth and at death.

    Returns means over agents (run, generation), for all weights and for each layer. Empty if the
    model has no weights.
    """
    if "distance" not in innate:
        return {}
    distance = innate["distance"]
    # The layers are parts of one vector of weights.
    total_distance = (distance**2).sum("layer", min_count=1) ** 0.5
    layer_distances = {
        f"distance, {layer}": distance.sel(layer=layer).mean("agent")
        for layer in distance["layer"].values
    }
    return {"distance": total_distance.mean("agent"), **layer_distances}


def drop_labels(values: xr.DataArray) -> xr.DataArray:
    """Return values (run) without coordinates other than `run`, which `xr.align` requires."""
    return values.drop_vars(set(values.coords) - {"run"})


def compute_share(part: xr.DataArray, total: xr.DataArray) -> xr.DataArray:
    """Return part / total, or NaN if the total is 0."""
    return part / total.where(total > 0)


def count_steps(within_life: xr.Dataset) -> int:
    """Return the number of steps of a lifetime."""
    text = within_life.attrs["experiment"]
    return from_toml(text, source="the assay", lenient=True).lifetime.steps


def name_latest_newborns(within_life: xr.Dataset) -> str:
    """Return the name of the newborns of the latest measured generation, or ""."""
    names = [str(name) for name in within_life["newborns"].values if name != RANDOM_NEWBORNS]
    return max(names, key=parse_generation, default="")


def parse_generation(newborns: str) -> int:
    """Return the generation at the end of a name of newborns."""
    return int(newborns.split()[-1])


def compute_quantities(assays: Assays, condition: str, last: int) -> dict[Quantity, xr.DataArray]:
    """Return all quantities of a condition.

    `last`: number of generations in the windows "first" and "last", at least 1. The window
    "throughout" has all generations. Returns values (run), NaN if they are undefined.
    """
    if last < 1:
        raise ValueError(f"last = {last} must be at least 1 generation")
    return {
        quantity: values
        for assay, compute in QUANTITIES_BY_ASSAY.items()
        if condition in assays.get(assay, {})
        for quantity, values in compute(assays[assay][condition], last)
    }


def _split_windows(values: xr.DataArray, last: int) -> dict[str, xr.DataArray]:
    """Return the values of each window of generations."""
    # The stored integers are too small for comparisons with a very large `last`.
    generation = values["generation"].astype(np.int64)
    return {
        "first": values.where(generation < generation.min() + last, drop=True),
        "last": values.where(generation > generation.max() - last, drop=True),
        "throughout": values,
    }


def _innate_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    for window, fitness in _split_windows(mean_fitness(data), last).items():
        fitness_by_life = {name: fitness.sel(life=name) for name in LIFE_KINDS}
        averages = {name: values.mean("generation") for name, values in fitness_by_life.items()}
        for name, average in averages.items():
            yield (name, window), average
        # Only some generations have the drift control.
        has_drift = fitness_by_life["drift"].notnull()
        yield (
            ("on, with drift control", window),
            fitness_by_life["on"].where(has_drift).mean("generation"),
        )
        yield ("gain", window), averages["on"] - averages["off"]
        yield ("innate share", window), compute_share(averages["off"], averages["on"])
        yield ("frozen share", window), compute_share(averages["frozen"], averages["on"])
    for name, distance in weight_distances(data).items():
        for window, values in _split_windows(distance, last).items():
            yield (name, window), values.mean("generation")


def _neutral_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    fitness = _split_windows(data["energy"], last)["last"].mean(("agent", "generation"))
    for newborns in NEUTRAL_NEWBORNS:
        off = fitness.sel(newborns=newborns, life="off")
        on = fitness.sel(newborns=newborns, life="on")
        yield ("off, neutral assay", newborns), off
        yield ("on, neutral assay", newborns), on
        yield ("gain, neutral assay", newborns), on - off


def _within_life_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    n_steps = count_steps(data)
    names_by_agents = {
        RANDOM_NEWBORNS: RANDOM_NEWBORNS,
        EVOLVED_NEWBORNS: name_latest_newborns(data),
    }
    for agents, name in names_by_agents.items():
        # No generation was measured if `name` is "".
        if name not in data["newborns"].values:
            continue
        newborns = data.sel(newborns=name)
        eaten = newborns["eaten_in_window"].mean("agent")
        is_complete = eaten.notnull().all("window")
        first_meal = newborns["first_meal"]
        yield ("eaten in life", agents), eaten.sum("window").where(is_complete)
        yield ("eaten in the first part of life", agents), eaten.isel(window=0)
        yield ("eaten in the last part of life", agents), eaten.isel(window=-1)
        # The first meal of an agent that never eats is the end of its lifetime.
        yield ("first meal", agents), first_meal.fillna(n_steps).mean("agent").where(is_complete)
        yield ("ever ate", agents), first_meal.notnull().mean("agent").where(is_complete)


def _module_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    for name in data["modules"].values:
        yield ("modules", str(name)), data["energy"].sel(modules=name).mean("agent")


def _reaction_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    fitness = data["energy"].mean("agent")
    settings = zip(data["field"].values, data["value"].values, strict=True)
    names = [name_setting(field, value) for field, value in settings]
    unchanged_fitness = None
    if UNCHANGED_SETTING in names:
        unchanged_fitness = fitness.isel(setting=names.index(UNCHANGED_SETTING))
    for setting_index, name in enumerate(names):
        setting_fitness = fitness.isel(setting=setting_index)
        yield ("setting", name), setting_fitness
        if unchanged_fitness is not None and name != UNCHANGED_SETTING:
            yield ("setting, relative", name), compute_share(setting_fitness, unchanged_fitness)


def name_setting(field: str, value: str) -> str:
    """Return the name of a changed setting, or of the setting of evolution."""
    return UNCHANGED_SETTING if field == UNCHANGED_SETTING else f"{field} = {value}"


def _descent_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    for name in ("common_ancestor_age", "effective_ancestors"):
        measure = name.replace("_", " ")
        yield (measure, "last"), data[name].isel(generation=-1)


def _reaction_norm_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    yield from reaction_norms.compute_quantities(data)


def _canalization_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    yield from canalization.compute_quantities(data)


def _fork_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    for measure, effects in compute_effects(data).items():
        for generation in data["generation"].values.tolist():
            yield (measure, f"generation {generation}"), effects.sel(generation=generation)


def _fork_mode_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    for (measure, start), values in _fork_quantities(data, last):
        yield (measure, f"mode of {start}"), values


QUANTITIES_BY_ASSAY: Final[Mapping[str, Callable[[xr.Dataset, int], Iterator[QuantityValues]]]] = {
    "innate": _innate_quantities,
    "neutral": _neutral_quantities,
    "within-life": _within_life_quantities,
    "modules": _module_quantities,
    "reaction": _reaction_quantities,
    "descent": _descent_quantities,
    "reaction-norms": _reaction_norm_quantities,
    "canalization": _canalization_quantities,
    "fork": _fork_quantities,
    "fork-mode": _fork_mode_quantities,
}


def evolves_and_learns(experiment: BaseExperiment, innate: xr.Dataset | None) -> bool:
    """Return whether a condition evolves and learns.

    A model other than MiniWorld may not be loaded. Then the stored assay `innate` shows whether the
    condition learns.
    """
    if experiment.evolution.inheritance == "none":
        return False
    if isinstance(experiment, Experiment):
        return experiment.learns
    return innate is not None and bool(innate["energy"].sel(life="on").notnull().any())
