"""What a population achieved, by generation and at last.

A study has the dimensions (condition, run, generation, agent); missing runs are NaN and stay NaN. Fitness is the energy of
the items that an agent ate in its life: in the paper's experiments the number of items, since each gives 1.

Source: the paper, "Learning Facilitates Evolution", for the best and the mean; "The Emergence of Intelligent Foraging"
for the share of agents that reach the food.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy import stats

Lives = npt.NDArray[Any]  # a number of each agent [generation, agent], or of each generation
Curve = Callable[[xr.Dataset], xr.DataArray]


def _known(measure: Curve) -> Curve:
    """What `with_curves` has kept of a study, or else what the measure is."""

    @wraps(measure)
    def of(study: xr.Dataset) -> xr.DataArray:
        return (
            study[_kept_as(measure.__name__)]
            if _kept_as(measure.__name__) in study
            else measure(study)
        )

    return of


def _kept_as(measure: str) -> str:
    return f"{measure} by generation"


@_known
def best(study: xr.Dataset) -> xr.DataArray:
    """Fitness of the fittest agent: (condition, run, generation), energy."""
    return _of_agents(study["energy"], lambda energy: np.fmax.reduce(energy, axis=-1))


@_known
def mean(study: xr.Dataset) -> xr.DataArray:
    """Fitness of the average agent: (condition, run, generation), energy."""
    return _of_agents(
        study["energy"],
        lambda energy: np.where(np.isnan(energy), 0, energy).sum(axis=-1) / _count(energy),
    )


@_known
def share(study: xr.Dataset) -> xr.DataArray:
    """Share of agents that ate at least one item in their life: (condition, run, generation), 0 to 1.

    Of models without food, of those that gained anything.
    """
    eaters = _of_agents(gained(study), lambda food: (food > 0).sum(axis=-1) / _count(food))
    return eaters.drop_attrs(deep=False).assign_attrs(valid_max=1.0)


def _of_agents(values: xr.DataArray, of: Callable[[Lives], Lives]) -> xr.DataArray:
    """`of` all lives [generation, agent] of a run, run by run: scratch for all runs at once would be as large as the study.

    NaN where nobody lived.
    """
    lives = values.transpose(..., "generation", "agent")
    found = lives.isel(agent=0, drop=True).astype(np.float64)
    with np.errstate(invalid="ignore"):
        for run in np.ndindex(lives.shape[:-2]):
            found.values[run] = of(lives.values[run])
    return found


def _count(values: Lives) -> Lives:
    """How many agents lived, by generation."""
    lived: Lives = (~np.isnan(values)).sum(axis=-1)
    return lived


def gained(study: xr.Dataset) -> xr.DataArray:
    """Items eaten; of models without food, fitness."""
    energy = study["energy"]
    return study["food_eaten"].fillna(energy) if "food_eaten" in study else energy


MEASURES: Mapping[str, Curve] = {"best": best, "mean": mean, "share": share}


def with_curves(study: xr.Dataset) -> xr.Dataset:
    """The study, which keeps `MEASURES` from now on: a report asks for them some twenty times, of up to millions of lives."""
    return study.assign({_kept_as(name): of(study) for name, of in MEASURES.items()})


def final(study: xr.Dataset, measure: str, last: int = 10) -> xr.DataArray:
    """`measure` (best, mean or share) averaged over the last `last` generations: (condition, run).

    Each condition ends with its own last generation; one of fewer than `last` is averaged over all it has.
    Raises KeyError for an unknown measure, ValueError unless `last` is at least 1.
    """
    return _window(MEASURES[measure](study), last, from_end=True)


def initial(study: xr.Dataset, measure: str, first: int = 10) -> xr.DataArray:
    """`measure` averaged over the first `first` generations: (condition, run). Raises as `final` does."""
    return _window(MEASURES[measure](study), first, from_end=False)


def _window(values: xr.DataArray, length: int, from_end: bool) -> xr.DataArray:
    if length < 1:
        raise ValueError(f"a window of {length} generations: it must have at least 1")
    lived = values.notnull().any("run")
    number = lived.cumsum("generation")
    inside = number > lived.sum("generation") - length if from_end else number <= length
    return values.where(lived & inside).mean("generation", keep_attrs=True)


def typical_run(study: xr.Dataset, condition: str) -> int:
    """The run of a condition whose final mean fitness is nearest to the median of all its runs: the one to show.

    Raises ValueError where the condition has no run.
    """
    means = final(study, "mean").sel(condition=condition).dropna("run")
    if not means.size:
        raise ValueError(f"there is no run of {condition}")
    return int(means["run"][abs(means - means.median()).argmin("run")])


def most(study: xr.Dataset) -> xr.DataArray:
    """Items eaten by the agent that ate most of all generations: (condition, run); of models without food, fitness."""
    return (
        gained(study).max(("generation", "agent"))
        if "food_eaten" in study
        else best(study).max("generation")
    )


def interval_of_mean(
    values: xr.DataArray, over: str = "run"
) -> tuple[xr.DataArray, xr.DataArray, xr.DataArray]:
    """Mean over runs (or another dimension) and its 95 % interval by Student's t; the interval is NaN for a single one.

    Of values none of which is negative, the mean is not either: the interval ends at 0, and still covers it as often.
    Likewise it ends at their `valid_max` where they have that attribute, as shares have.
    """
    count = values.count(over)
    average = values.mean(over)
    spread = ((values - average) ** 2).sum(over) / (count - 1).where(count > 1)
    half = np.sqrt(spread / count) * xr.zeros_like(average).copy(
        data=stats.t.ppf(0.975, np.maximum(count - 1, 1))
    )
    low, high = average - half, average + half
    return (
        average,
        low if bool((values < 0).any()) else low.clip(min=0),
        high.clip(max=values.attrs.get("valid_max")),
    )


def interval_of_median(
    values: xr.DataArray, over: str = "run"
) -> tuple[xr.DataArray, xr.DataArray, xr.DataArray]:
    """Median over runs (or another dimension) and its 95 % interval, whose ends are values of the sample.

    It is the interval of the sign test, from the k-th smallest to the k-th largest value, whatever their distribution; of fewer
    than six there is none (NaN). Source: W. R. Thompson, Annals of Mathematical Statistics 7 (1936).
    """
    ordered, count = values.transpose(..., over), values.count(over)
    sample = np.sort(ordered.values, axis=-1)  # NaN last
    rank = stats.binom.ppf(0.025, np.maximum(count.values, 1), 0.5).astype(np.int64)

    def the(place: np.ndarray) -> xr.DataArray:
        found = np.take_along_axis(
            sample, np.clip(place, 0, sample.shape[-1] - 1)[..., None], axis=-1
        )[..., 0]
        return count.copy(data=np.where(rank > 0, found, np.nan))

    return values.median(over), the(rank - 1), the(count.values - rank)
