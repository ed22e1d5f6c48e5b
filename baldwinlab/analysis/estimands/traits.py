"""Traits of a model: innate traits under selection, and the distance that learning covers."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.assays.values import weight_distances
from baldwinlab.core.variables import GENERATION_COUNT
from baldwinlab.experiment import BaseExperiment

INNATE_FITNESS: Final = "innate fitness"


class Trait(NamedTuple):
    """A trait of a condition.

    Attributes
    ----------
    name : str
        Meaning of the trait.
    unit : str
        Unit of the values.
    values : xr.DataArray
        (run, generation, agent) for an innate trait, (run, generation) for a distance.
    """

    name: str
    unit: str
    values: xr.DataArray


def select_innate_trait(data: xr.Dataset, innate: xr.Dataset, experiment: BaseExperiment) -> Trait:
    """Return the innate trait on which selection is measured.

    It is the record that the model declares as `innate_trait`, in the generations and runs of the
    assay `innate`, else innate fitness.
    """
    model = experiment.loaded_model
    name = model.innate_trait if model is not None else ""
    if model is None or name not in data:
        fitness = innate["energy"].sel(life="off", drop=True)
        return Trait(INNATE_FITNESS, "fitness", fitness)
    return read_record(_select_assayed(data, innate), model, name)


def select_learned_distance(
    data: xr.Dataset, innate: xr.Dataset, experiment: BaseExperiment
) -> Trait | None:
    """Return the distance between birth and the goal of learning, on the scale of the trait.

    It is the mean over agents of the record or share that the model declares as `learned_distance`,
    else of the distance of weights between birth and death. None if the model has neither.
    """
    model = experiment.loaded_model
    name = model.learned_distance if model is not None else ""
    runs = _select_assayed(data, innate)
    if model is not None and name in model.shares:
        share = model.shares[name]
        return Trait(share.meaning, "1", share.of(runs))
    if model is not None and name in data:
        record = read_record(runs, model, name)
        return record._replace(values=record.values.mean("agent"))
    distance = weight_distances(innate).get("distance")
    if distance is None or not bool(distance.notnull().any()):
        return None
    return Trait("distance of the weights between birth and death", "1", distance)


def read_record(runs: xr.Dataset, model: Any, name: str) -> Trait:
    """Return a record of a model, with its meaning and its unit."""
    variable = model.records[name]
    return Trait(variable.meaning, variable.unit, runs[name].astype(np.float64))


def _select_assayed(data: xr.Dataset, innate: xr.Dataset) -> xr.Dataset:
    """Return the runs and generations of the assay.

    A run that stopped has its last generation in the later ones, as in the assay.
    """
    runs = data.sel(run=innate["run"])
    if GENERATION_COUNT not in runs.coords:
        return runs.sel(generation=innate["generation"])
    generation = np.minimum(innate["generation"], runs[GENERATION_COUNT] - 1)
    return runs.sel(generation=generation).assign_coords(generation=innate["generation"])
