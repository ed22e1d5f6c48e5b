"""Conversion between records and runs, and between batches and records.

A record is a run with the genomes of only some generations. A batch has the records of several runs
of a condition in one dataset. Every variable of a record has the additional first dimension `run`
in a batch. The attributes and the labels of agents, parents, modules and weights are shared. Runs
can have different numbers of generations. Shorter runs are padded, and these variables state the
valid part:

    n_generations(run)                       number of simulated generations
    kept_generations(run, kept_generation)   generations with stored genomes, padded with -1
    stopped_by(run)                          stop part that ended the run, "" for none; only in
                                             batches with a stopped run
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping
from typing import Any, Final

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.core.variables import GENERATION_COUNT, RUN_ARRAY_PREFIX, STOP_ATTRIBUTE

RUN_DIM: Final = "run"
KEPT_GENERATIONS: Final = "kept_generations"
# Variables of a batch that the record of a single run does not have.
BATCH_VARIABLES: Final = (GENERATION_COUNT, KEPT_GENERATIONS, STOP_ATTRIBUTE)
# Finds the number of generations in the TOML text of an experiment.
_GENERATIONS_PATTERN: Final = re.compile(r"(^\[evolution\]$.*?^generations = )\d+", re.M | re.S)


def as_record(run: xr.Dataset) -> xr.Dataset:
    """Return a run as a record, without the genomes that are NaN. A record is unchanged."""
    if "kept_genome" in run:
        return run
    is_generation_stored = run.genome.notnull().any(("agent", "module", "weight")).values
    stored_genomes = run.genome[is_generation_stored].rename(generation="kept_generation")
    return run.drop_vars("genome").assign(kept_genome=stored_genomes)


def as_run(record: xr.Dataset) -> xr.Dataset:
    """Return a record as a run. The genomes of generations without stored genomes are NaN."""
    genome = record.kept_genome.rename(kept_generation="generation").reindex(
        generation=record.generation
    )
    return (
        without_run_arrays(record)
        .drop_vars(["kept_genome", "kept_generation"])
        .assign(genome=genome.astype(np.float32))
    )


def without_genomes(record: xr.Dataset) -> xr.Dataset:
    """Return a record as a run without genomes."""
    dataset = record.drop_dims("kept_generation").drop_vars(["module", "weight"])
    return without_run_arrays(dataset)


def without_run_arrays(record: xr.Dataset) -> xr.Dataset:
    """Return a record without the run arrays of parts."""
    names = [name for name in record.data_vars if str(name).startswith(RUN_ARRAY_PREFIX)]
    return record.drop_vars(names) if names else record


def replace_generations(text: str, n_generations: int) -> str:
    """Return the TOML text of an experiment with another number of generations."""
    return _GENERATIONS_PATTERN.sub(rf"\g<1>{n_generations}", text, count=1)


def read_generations(text: str) -> int | None:
    """Return the number of generations in the TOML text of an experiment, None if it has none."""
    match = _GENERATIONS_PATTERN.search(text)
    return int(match[0][len(match[1]) :]) if match else None


def select_attributes(batch: xr.Dataset, index: int) -> dict[str, Any]:
    """Return the attributes of the record of one run of a batch."""
    attributes: dict[str, Any] = {}
    for name, value in batch.attrs.items():
        attributes[str(name)] = value
        # The attribute `run` follows the seed, as in the record of one run.
        if name == "seed":
            attributes[RUN_DIM] = int(batch[RUN_DIM].values[index])
    n_generations = int(batch[GENERATION_COUNT].values[index])
    attributes["experiment"] = replace_generations(attributes["experiment"], n_generations)
    if stop := list_stops(batch)[index]:
        attributes[STOP_ATTRIBUTE] = stop
    return attributes


def list_stops(batch: xr.Dataset) -> list[str]:
    """Return the stop part that ended each run of a batch, "" for none."""
    if STOP_ATTRIBUTE not in batch:
        return [""] * batch.sizes[RUN_DIM]
    stops: list[str] = batch[STOP_ATTRIBUTE].values.astype(str).tolist()
    return stops


def select_record(batch: xr.Dataset, index: int) -> xr.Dataset:
    """Return the record of one run of a batch. The record shares its arrays with the batch."""
    kept_generations = batch[KEPT_GENERATIONS].values[index]
    kept_generations = kept_generations[kept_generations >= 0]
    valid = {
        RUN_DIM: index,
        "generation": slice(int(batch[GENERATION_COUNT].values[index])),
        "kept_generation": slice(len(kept_generations)),
    }
    per_run = {
        name: _select_valid(variable, valid)
        for name, variable in batch.variables.items()
        if name in batch.data_vars and name not in BATCH_VARIABLES
    }
    coordinates: dict[Hashable, Any] = {
        name: _select_valid(batch.variables[name], valid)
        for name in batch.coords
        if name != RUN_DIM
    }
    labels = insert_kept_generation(coordinates, ("kept_generation", kept_generations))
    return xr.Dataset(order_record(per_run, labels), attrs=select_attributes(batch, index))


def order_record(data: Mapping[Any, Any], labels: Mapping[Any, Any]) -> dict[Any, Any]:
    """Return the variables of a record and the labels of the dimensions in the order of a file.

    With this order, a file has the same bytes as with earlier versions of the package.
    """
    names = list(data)
    first_genome = names.index("kept_genome")
    before = {name: data[name] for name in names[:first_genome]}
    return before | dict(labels) | {name: data[name] for name in names[first_genome:]}


def _select_valid(variable: xr.Variable, valid: Mapping[str, Any]) -> xr.Variable:
    return variable.isel({dim: valid[str(dim)] for dim in variable.dims if dim in valid})


def insert_kept_generation(coordinates: Mapping[Any, Any], kept_generations: Any) -> dict[Any, Any]:
    """Insert the labels of `kept_generation` after the labels of `weight`."""
    ordered: dict[Any, Any] = {}
    for name, values in coordinates.items():
        ordered[name] = values
        if name == "weight":
            ordered["kept_generation"] = kept_generations
    return ordered
