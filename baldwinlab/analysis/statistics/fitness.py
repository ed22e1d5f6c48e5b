"""Measure the fitness of populations by generation, at the start and at the end of a run.

The functions take a dataset with the dimensions (condition, run, generation, agent). Missing runs
are NaN, in the input and in the result. A run that stopped early repeats the value of its last
simulated generation, until the longest run of its condition ends.
Fitness is the energy of the items that an agent eats during its lifetime. In Le (2019) each item
gives 1, so fitness is the number of items.

References
----------
Best and mean: N. Le (2019), section "Learning Facilitates Evolution".
Share: N. Le (2019), section "The Emergence of Intelligent Foraging".
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.core.variables import GENERATION_COUNT
from baldwinlab.experiment.outcome import FITNESS

AgentValues = npt.NDArray[Any]  # [generation, agent]
Curve = Callable[[xr.Dataset], xr.DataArray]
SUMMARY_COLUMNS = ("condition", "measure", *statistics.Summary._fields)
UNSEEN_MAPS_VARIABLE = "unseen maps"


def _prefer_cached(measure: Curve) -> Curve:
    """Wrap a measure: return the values that `cache_measures` stored, or else compute them."""

    @wraps(measure)
    def cached(dataset: xr.Dataset) -> xr.DataArray:
        name = _cache_name(measure.__name__)
        return dataset[name] if name in dataset else measure(dataset)

    return cached


def _cache_name(measure: str) -> str:
    return f"{measure} by generation"


@_prefer_cached
def best(dataset: xr.Dataset) -> xr.DataArray:
    """Compute the fitness of the best agent, (condition, run, generation)."""
    return _reduce_agents(dataset["energy"], lambda energy: np.fmax.reduce(energy, axis=-1))


@_prefer_cached
def mean(dataset: xr.Dataset) -> xr.DataArray:
    """Compute the mean fitness of the agents, (condition, run, generation)."""
    return _reduce_agents(
        dataset["energy"],
        lambda energy: np.where(np.isnan(energy), 0, energy).sum(axis=-1) / _count_agents(energy),
    )


@_prefer_cached
def share(dataset: xr.Dataset) -> xr.DataArray:
    """Compute the fraction of agents that eat at least one item, (condition, run, generation).

    For models without food, compute the fraction of agents with fitness above 0.
    """
    shares = _reduce_agents(
        gain(dataset), lambda food: (food > 0).sum(axis=-1) / _count_agents(food)
    )
    return shares.drop_attrs(deep=False).assign_attrs(valid_max=1.0)


def _reduce_agents(
    values: xr.DataArray, reduce: Callable[[AgentValues], AgentValues]
) -> xr.DataArray:
    """Apply `reduce` to the agents [generation, agent] of each run. NaN without a value."""
    agents = values.transpose(..., "generation", "agent")
    result = agents.isel(agent=0, drop=True).astype(np.float64)
    with np.errstate(invalid="ignore"):
        # Reduce one run at a time: intermediate arrays of all runs would be as large as the study.
        for run in np.ndindex(agents.shape[:-2]):
            result.values[run] = reduce(agents.values[run])
    return hold_last(result)


def hold_last(values: xr.DataArray) -> xr.DataArray:
    """Repeat the last value of each run that stopped, until the longest run of its condition ends.

    Without these values, the mean over runs would change whenever a run stops. Values without the
    coordinate of the number of generations of each run are returned unchanged.
    """
    if GENERATION_COUNT not in values.coords or "run" not in values[GENERATION_COUNT].dims:
        return values
    count = values[GENERATION_COUNT]
    has_stopped = (values["generation"] >= count) & (count > 0)
    is_held = has_stopped & (values["generation"] < count.max("run"))
    # For runs without data (count 0), the index 0 has no effect, because `is_held` is False.
    last_values = values.isel(generation=(count - 1).clip(min=0)).drop_vars("generation")
    return values.where(~is_held, last_values).transpose(*values.dims)


def _count_agents(values: AgentValues) -> AgentValues:
    """Count the agents with a value, by generation."""
    counts: AgentValues = (~np.isnan(values)).sum(axis=-1)
    return counts


def gain(dataset: xr.Dataset) -> xr.DataArray:
    """Return the number of items that each agent eats, or the fitness in models without food."""
    energy = dataset["energy"]
    return dataset["food_eaten"].fillna(energy) if "food_eaten" in dataset else energy


def outcome(dataset: xr.Dataset) -> str:
    """Return the name of the fitness in a dataset, for example "items eaten"."""
    return str(dataset.attrs.get("outcome", FITNESS))


MEASURES: Mapping[str, Curve] = {"best": best, "mean": mean, "share": share}


def cache_measures(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset with a variable for each of `MEASURES`, which the measures then read.

    A report reads the measures about twenty times, and a study may have millions of agents.
    """
    curves = {_cache_name(name): measure(dataset) for name, measure in MEASURES.items()}
    return dataset.assign(curves)


def final(dataset: xr.Dataset, measure: str, last: int = 10) -> xr.DataArray:
    """Average one of `MEASURES` over the last generations of each run, (condition, run).

    A condition with fewer generations is averaged over all generations. A condition ends with the
    last stored generation. A run that stopped ends with the last simulated generation.
    """
    return average_last(MEASURES[measure](dataset), last)


def average_last(values: xr.DataArray, last: int) -> xr.DataArray:
    """Average values over the last generations of each run. `last` is at least 1."""
    return _average_window(values, last, from_end=True)


def initial(dataset: xr.Dataset, measure: str, first: int = 10) -> xr.DataArray:
    """Average one of `MEASURES` over the first generations of each run, (condition, run)."""
    return _average_window(MEASURES[measure](dataset), first, from_end=False)


def _average_window(values: xr.DataArray, length: int, from_end: bool) -> xr.DataArray:
    if length < 1:
        raise ValueError(f"a window of {length} generations: it must have at least 1")
    is_present = values.notnull().any("run")
    if GENERATION_COUNT in values.coords:
        # A stopped run ends before the other runs of its condition.
        is_present = is_present & (values["generation"] < values[GENERATION_COUNT])
    # Conditions end at different generations, so count only generations with a value.
    position = is_present.cumsum("generation")  # Rank of a generation, from 1.
    n_skipped = is_present.sum("generation") - length
    is_inside = position > n_skipped if from_end else position <= length
    return values.where(is_present & is_inside).mean("generation", keep_attrs=True)


def typical_run(dataset: xr.Dataset, condition: str, last: int = 10) -> int:
    """Return the run whose final mean fitness is nearest to the median. ValueError without runs."""
    means = final(dataset, "mean", last).sel(condition=condition).dropna("run")
    if not means.size:
        raise ValueError(f"there is no run of {condition}")
    distances = abs(means - means.median())
    return int(means["run"][distances.argmin("run")])


def largest_gain(dataset: xr.Dataset) -> xr.DataArray:
    """Return the largest number of items that an agent eats in any generation, (condition, run).

    For models without food, return the largest fitness.
    """
    if "food_eaten" in dataset:
        return gain(dataset).max(("generation", "agent"))
    return best(dataset).max("generation")


def compute_species_curves(
    data: xr.Dataset, names: Sequence[str], curves: Iterable[str]
) -> dict[str, dict[str, xr.DataArray]]:
    """Compute curves (..., run, generation), by name of the curve and of the species.

    `curves` are names that `list_species_curves` returns. "composition" is the fraction of all
    agents that belong to the species. The fitness of a species without agents is NaN.
    """
    return {
        curve: {
            name: hold_last(_compute_curve(data, curve, index)) for index, name in enumerate(names)
        }
        for curve in curves
    }


def _compute_curve(data: xr.Dataset, curve: str, index: int) -> xr.DataArray:
    """Return the curve of the species with the given index."""
    is_member = data["species"] == index
    n_agents = data["species"].notnull().sum("agent")
    energy = data["energy"].where(is_member)
    if curve == "mean":
        return energy.mean("agent")
    if curve == "share":
        is_above = (energy > 0).where(energy.notnull())
        return is_above.mean("agent").assign_attrs(valid_max=1.0)
    if curve == "composition":
        return (is_member.sum("agent") / n_agents.where(n_agents > 0)).assign_attrs(valid_max=1.0)
    counted = is_member if curve == "size" else data["alive"].where(is_member)
    counts = counted.sum("agent").where(n_agents > 0)
    return counts.assign_attrs(valid_max=float(n_agents.max()))


def summarize_conditions(dataset: xr.Dataset, last: int = 10) -> list[dict[str, Any]]:
    """Summarize best, mean and share of the last generations for each condition that has runs.

    The result has one row per condition and measure, with the keys `SUMMARY_COLUMNS`.
    """
    finals = {measure: final(dataset, measure, last) for measure in MEASURES}
    rows = []
    for condition in dataset["condition"].values:
        for measure, values in finals.items():
            sample = values.sel(condition=condition).dropna("run").values
            if sample.size:
                row = {"condition": str(condition), "measure": measure}
                rows.append(row | statistics.summarize(sample)._asdict())
    return rows


def add_unseen_maps(data: xr.Dataset, assays: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Add the mean fitness on unseen maps to the runs, as `UNSEEN_MAPS_VARIABLE` (condition, run).

    `assays`: the stored assay `unseen-maps` by condition. The new variable is NaN for conditions
    without the assay. Without any assay, the dataset is returned unchanged.
    """
    if not assays:
        return data
    values = _make_undefined(data)
    for condition, assay in assays.items():
        means = assay["energy"].mean("map")
        values.loc[{"condition": condition, "run": means["run"].values}] = means.values
    return data.assign({UNSEEN_MAPS_VARIABLE: values})


def get_unseen_maps(data: xr.Dataset) -> xr.DataArray:
    """Return the mean fitness on unseen maps (condition, run); NaN without the assay."""
    return data[UNSEEN_MAPS_VARIABLE] if UNSEEN_MAPS_VARIABLE in data else _make_undefined(data)


def _make_undefined(data: xr.Dataset) -> xr.DataArray:
    """Return an array (condition, run) of NaN."""
    shape = (data.sizes["condition"], data.sizes["run"])
    coordinates = {"condition": data["condition"].values, "run": data["run"].values}
    return xr.DataArray(np.full(shape, np.nan), coordinates)
