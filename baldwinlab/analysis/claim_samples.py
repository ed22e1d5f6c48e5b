"""Samples that `claims.py` compares: one value of a measure per run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.fitness import get_unseen_maps
from baldwinlab.analysis.statistics.survival import Survival
from baldwinlab.experiment.measures import measure_runs
from baldwinlab.papers import load
from baldwinlab.papers.claims import COMMON_MEASURES, UNSEEN_MAPS_MEASURE, Claim, ClaimComparison


class ClaimSource(Protocol):
    """A paper, or another source of claims."""

    @property
    def claims(self) -> tuple[Claim, ...]:
        """All claims."""

    def measures(self, name: str, /) -> Mapping[str, Any] | None:
        """Return the measures of the model of a condition, or None if the model is not loaded."""
        ...


class ModelMeasure(NamedTuple):
    """A measure that a model defines, with one value per run."""

    name: str
    meaning: str
    # Values [run] by condition. Empty if the model of the condition lacks the measure.
    values: dict[str, npt.NDArray[np.float64]]


class Samples:
    """Values of the measures that claims compare: one value per measure and run.

    The measures best, mean and share are averages over the last or the first generations of a run.
    A model can define further measures.

    `data`: the runs, with the dimensions (condition, run, generation, agent). `last`: number of
    averaged generations. `source`: the source of the claims, by default the default paper.
    """

    def __init__(self, data: xr.Dataset, last: int = 10, source: ClaimSource | None = None) -> None:
        data = fitness.cache_measures(data)
        self.source = source or load()
        self._data = data
        self._final_values = {
            measure: fitness.final(data, measure, last) for measure in fitness.MEASURES
        }
        self._final_values["most"] = fitness.largest_gain(data)
        self._final_values[UNSEEN_MAPS_MEASURE] = get_unseen_maps(data)
        self._initial_values = {
            measure: fitness.initial(data, measure, last) for measure in fitness.MEASURES
        }
        # Cached values [run] of the measures that models define, by (condition, measure).
        self._model_values: dict[tuple[str, str], xr.DataArray] = {}
        n_runs = self._final_values["best"].notnull().sum("run").values
        names = [str(name) for name in data["condition"].values]
        # Number of runs with data, by condition.
        self.n_runs = dict(zip(names, n_runs.tolist(), strict=True))
        self.conditions_with_runs = {name for name, n_runs in self.n_runs.items() if n_runs}

    def unloaded_measures(self, claim: Claim) -> set[str]:
        """Return the measures of a claim whose model is not loaded."""
        return {
            comparison.measure
            for comparison in claim.comparisons
            if comparison.measure not in COMMON_MEASURES
            and any(self.source.measures(name) is None for name in comparison.conditions)
        }

    def unassayed_measures(self, claim: Claim) -> set[str]:
        """Return the measures of a claim whose assay is not stored for all conditions."""
        return {
            comparison.measure
            for comparison in claim.comparisons
            if comparison.measure == UNSEEN_MAPS_MEASURE
            and any(not self.get(name, comparison.measure).size for name in comparison.conditions)
        }

    def meaning(self, comparison: ClaimComparison) -> str:
        """Return the meaning of a measure that a model defines, or ""."""
        if comparison.measure in COMMON_MEASURES:
            return ""
        measures = self.source.measures(comparison.a) or {}
        return measures[comparison.measure].meaning if comparison.measure in measures else ""

    def get(self, condition: str, measure: str, first: bool = False) -> xr.DataArray:
        """Return the values [run] without NaN, by default of the last generations. Can be empty."""
        if measure in COMMON_MEASURES:
            values = self._initial_values if first else self._final_values
            return values[measure].sel(condition=condition).dropna("run").astype(np.float64)
        key = (condition, measure)
        if key not in self._model_values:
            self._model_values[key] = self._measure_model(condition, measure)
        return self._model_values[key]

    def survival(self, condition: str, measure: str) -> Survival:
        """Return the survival time of each run, and whether the time is censored."""
        measures = self.source.measures(condition) or {}
        times = self.get(condition, measure)
        runs = self._data.sel(condition=condition, run=times["run"].values)
        is_censored = measure_runs(measures[measure].censored, _drop_gaps(runs))
        return Survival(times.values, is_censored.values)

    def model_measures(self) -> list[ModelMeasure]:
        """Return the measures of models that claims use to compare two conditions."""
        meanings = {
            comparison.measure: meaning
            for claim in self.source.claims
            for comparison in claim.comparisons
            if comparison.b and (meaning := self.meaning(comparison))
        }
        return [
            ModelMeasure(
                measure, meaning, {name: self.get(name, measure).values for name in self.n_runs}
            )
            for measure, meaning in meanings.items()
        ]

    def _measure_model(self, condition: str, measure: str) -> xr.DataArray:
        measures = self.source.measures(condition) or {}
        if measure not in measures:
            return xr.DataArray(np.empty(0), {"run": np.empty(0, np.int64)})
        runs = _drop_gaps(self._data.sel(condition=condition))
        values = measure_runs(measures[measure].of, runs)
        # An infinite value, such as a ratio to a change of 0, counts as no value.
        return values.where(np.isfinite(values)).dropna("run").astype(np.float64)


def _drop_gaps(runs: xr.Dataset) -> xr.Dataset:
    """Drop runs, generations and agents without data, but copy nothing if all have data."""
    for dim in ("run", "generation", "agent"):
        other_dims = [name for name in runs["energy"].dims if name != dim]
        has_data = runs["energy"].notnull().any(other_dims)
        if not bool(has_data.all()):
            runs = runs.isel({dim: has_data.values})
    return runs
