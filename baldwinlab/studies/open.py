"""Stored runs of a study as one dataset. This module loads no engine."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from baldwinlab.core.files import parse_location
from baldwinlab.core.variables import (
    DIMENSION_MEANINGS,
    GENERATION_COUNT,
    GENERATION_COUNT_ATTRIBUTES,
    PARENT_NAMES,
    RUN_VARIABLES,
)
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import factor_coordinates
from baldwinlab.experiment.toml import to_toml
from baldwinlab.studies.store import StudyStore


def open_runs(directory: str | Path, conditions: Sequence[str] | None = None) -> xr.Dataset:
    """Return the stored runs of a study as one dataset, without the genomes.

    Parameters
    ----------
    directory
        The directory of a study, or a URL that fsspec can open.
    conditions
        Names of conditions. Default: all conditions.

    Returns
    -------
    xarray.Dataset
        The variables of `baldwinlab.core.variables.RUN_VARIABLES`, with the dimensions `condition`,
        `run`, `generation` and `agent`. Missing values are NaN: conditions can differ in their
        numbers of runs, generations or agents, and a run that stopped has no later generations. If
        runs can stop, the coordinate `n_generations` (condition, run) is the number of simulated
        generations. `experiment` is each condition as TOML. `learner`, `map` and `variant` are
        coordinates of `condition` if a condition has them. Write `data["map"]`: `data.map` is a
        method of xarray. The attributes of a variable are its `units` and `long_name`.

    Raises
    ------
    StudyError
        There is no study, or it has no such condition.
    DamagedRecordError
        A stored run is damaged.
    """
    study = StudyStore(parse_location(directory))
    return open_conditions(study, list(study.experiments if conditions is None else conditions))


def open_conditions(study: StudyStore, names: Sequence[str]) -> xr.Dataset:
    """Return the stored runs of an open study as one dataset, as `open_runs` does."""
    datasets = [_open_condition(study, name) for name in names]
    data = concat_conditions(study, names, datasets)
    if not any(study.experiments[name].may_stop for name in names):
        return data
    counts = np.zeros((len(names), data.sizes["run"]), np.int32)
    for row, dataset in zip(counts, datasets, strict=True):
        run_indices = data.indexes["run"].get_indexer(dataset["run"].values)
        row[run_indices] = dataset.attrs[GENERATION_COUNT]
    coordinate = (("condition", "run"), counts, GENERATION_COUNT_ATTRIBUTES)
    return data.assign_coords({GENERATION_COUNT: coordinate})


def concat_conditions(
    study: StudyStore, names: Sequence[str], datasets: Sequence[xr.Dataset]
) -> xr.Dataset:
    """Concatenate the datasets of conditions, and add their factors and experiments.

    Parameters
    ----------
    study : StudyStore
        The study.
    names : sequence of str
        Names of the conditions.
    datasets : sequence of xarray.Dataset
        A dataset [run, generation, agent] of each condition, in the same order.

    Returns
    -------
    xarray.Dataset
        One dataset with the dimension `condition`.
    """
    experiment_texts = [to_toml(study.experiment(name)) for name in names]
    data = xr.concat(
        datasets, "condition", join="outer", data_vars="all", coords="minimal", combine_attrs="drop"
    )
    factors = factor_coordinates([study.factors[name] for name in names])
    data = data.assign_coords(condition=list(names)).assign_coords(factors)
    for name in data.data_vars:
        data[name].attrs = _common_attributes(name, datasets)
    for name in DIMENSION_MEANINGS.keys() & data.coords.keys():
        meaning = DIMENSION_MEANINGS[name]
        data[name].attrs = {"long_name": meaning}
    # The encoding of the records has integer types, which cannot store missing values.
    data = data.drop_encoding()
    return data.assign(experiment=("condition", experiment_texts)).assign_attrs(seed=study.seed)


def _common_attributes(name: Hashable, datasets: Sequence[xr.Dataset]) -> dict[Hashable, Any]:
    """Return the attributes of a variable, empty if its unit or meaning differs between models."""
    attributes = [data[name].attrs for data in datasets if name in data and data[name].attrs]
    if not attributes or any(entry != attributes[0] for entry in attributes):
        return {}
    return attributes[0]


def _open_condition(study: StudyStore, condition: str) -> xr.Dataset:
    runs = study.runs(condition)
    if not runs:
        return make_empty_dataset(study.experiments[condition])
    records = [study.read(condition, run, genomes=False) for run in runs]
    # Runs have different numbers of generations if some have stopped, or if an extended study is
    # not complete.
    data = xr.concat(records, "run", join="outer", combine_attrs="drop")
    data = data.assign_coords(run=np.array(runs, np.int32))
    data.attrs[GENERATION_COUNT] = [record.sizes["generation"] for record in records]
    # `concat` drops the units and meanings of the variables.
    for name, variable in records[0].data_vars.items():
        data[name].attrs = variable.attrs
    return data


def make_empty_dataset(experiment: Experiment) -> xr.Dataset:
    """Return an empty dataset for a condition without stored runs."""
    sizes = {
        "run": 0,
        "generation": experiment.evolution.generations,
        "agent": experiment.population.size,
        "parent": len(PARENT_NAMES),
    }
    names = (
        ("food_eaten", "energy", "parents")
        if isinstance(experiment, Experiment)
        else ("energy", "parents")
    )
    arrays = {}
    for name in names:
        dims = ("run", *RUN_VARIABLES[name].dims)
        shape = [sizes[dim] for dim in dims]
        arrays[name] = (dims, np.empty(shape, RUN_VARIABLES[name].dtype))
    coordinates: dict[str, Any] = {
        dim: np.arange(size, dtype=np.int32) for dim, size in sizes.items()
    }
    coordinates["parent"] = list(PARENT_NAMES)
    return xr.Dataset(arrays, coordinates, attrs={GENERATION_COUNT: []})
