"""Records of histories: the stored form of one run, or of a batch of runs in one file."""

from __future__ import annotations

import platform
from collections.abc import Hashable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numba
import numpy as np
import numpy.typing as npt

from baldwinlab._version import __version__
from baldwinlab.core import variables
from baldwinlab.core.deferred import xr
from baldwinlab.core.netcdf import LabeledArray, encode_arrays
from baldwinlab.core.records import (
    BATCH_VARIABLES,
    KEPT_GENERATIONS,
    RUN_DIM,
    as_run,
    insert_kept_generation,
    order_record,
    replace_generations,
    select_record,
)
from baldwinlab.core.variables import GENERATION_COUNT, STOP_ATTRIBUTE
from baldwinlab.evolution import Genome
from baldwinlab.evolution.species_breeding import SpeciesArrays
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.toml import to_toml
from baldwinlab.simulation.history import History

# Padding of the array `kept_generations`: no generation.
NO_GENERATION = -1


class RecordBatch(NamedTuple):
    """Records of several histories as one set of arrays. `core.records` describes the format."""

    # The variables of `record_variables` by name, with the additional first dimension `run`.
    data: dict[str, LabeledArray]
    coordinates: dict[str, LabeledArray]  # The labels of each dimension.
    attributes: dict[str, Any]

    def to_dataset(self) -> xr.Dataset:
        """Return the batch as a dataset, which `select_record` reads."""
        return xr.Dataset(self.data, self.coordinates, self.attributes)

    def encode(self) -> bytearray:
        """Return the bytes of the file of the batch."""
        return encode_arrays(self.data | self.coordinates, self.attributes)


def make_record(history: History) -> xr.Dataset:
    """Return the run of a history in its stored form, with the variables of `record_variables`."""
    return select_record(make_batch([history]).to_dataset(), 0)


def make_run_dataset(history: History) -> xr.Dataset:
    """Return the simulated generations of a history, at least one, as a dataset.

    The dataset is bit-identical to the run of an experiment with this number of generations.
    Copy the dataset if the simulation continues, because it uses the arrays of the history.
    """
    return as_run(make_record(history))


def encode_history(history: History) -> bytearray:
    """Return the bytes of the file of one history. The record has no dimension `run`."""
    batch = make_batch([history])
    data = {
        name: LabeledArray(variable.dims[1:], variable.values[0], variable.attributes)
        for name, variable in batch.data.items()
        if name not in BATCH_VARIABLES
    }
    kept_generations = batch.data[KEPT_GENERATIONS].values[0]
    coordinates = {name: array for name, array in batch.coordinates.items() if name != RUN_DIM}
    stored = LabeledArray(("kept_generation",), kept_generations)
    ordered = order_record(data, insert_kept_generation(coordinates, stored))
    attributes = provenance_attributes(
        _shorten(history.experiment, history.n_generations), history.seed, history.run
    )
    if history.is_stopped:
        attributes[STOP_ATTRIBUTE] = name_stop(history)
    return encode_arrays(ordered, attributes)


def make_batch(histories: Sequence[History]) -> RecordBatch:
    """Return the records of several histories as one set of arrays.

    The histories must have equal `BatchKeys.key`, and at least one generation each.
    """
    longest = max(histories, key=lambda history: history.n_generations)
    experiment = _shorten(longest.experiment, longest.n_generations)
    declared = variables.record_variables(experiment)
    attributes = {**_shared_attributes(experiment, longest.seed)}

    data: dict[str, LabeledArray] = {}

    def add(name: str, array: npt.NDArray[Any]) -> None:
        dims, dtype, unit, meaning = declared[name]
        meanings = {"units": unit, "long_name": meaning}
        data[name] = LabeledArray((RUN_DIM, *dims), np.asarray(array, dtype), meanings)

    for name in longest.recorded_names:
        add(name, stack_padded([history.recorded_values(name) for history in histories], fill=0))
    add("energy", stack_padded([history.energy for history in histories], fill=0))
    add("parents", stack_padded([history.parents for history in histories], fill=0))
    saved_genomes = [history.saved_genomes for history in histories]
    genomes = _stack_genomes(saved_genomes)
    add("kept_genome", genomes)
    data |= _stack_run_arrays([history.stored_run_arrays for history in histories])
    counts = np.array([history.n_generations for history in histories], np.int32)
    data[GENERATION_COUNT] = LabeledArray((RUN_DIM,), counts)
    saved_generations = [np.array([*genomes_of_run], np.int32) for genomes_of_run in saved_genomes]
    data[KEPT_GENERATIONS] = LabeledArray(
        (RUN_DIM, "kept_generation"), stack_padded(saved_generations, NO_GENERATION)
    )
    if any(history.is_stopped for history in histories):
        stops = [name_stop(history) for history in histories]
        data[STOP_ATTRIBUTE] = LabeledArray((RUN_DIM,), stops)
    # [run, kept generation, agent, module, weight].
    *_, n_agents, _, n_weights = genomes.shape
    labels: dict[str, Any] = {
        RUN_DIM: np.array([history.run for history in histories], np.int32),
        "generation": np.arange(longest.n_generations, dtype=np.int32),
        "agent": np.arange(n_agents, dtype=np.int32),
        "parent": list(variables.PARENT_NAMES),
        "module": list(experiment.modules),
        "weight": np.arange(n_weights, dtype=np.int32),
        **variables.window_coordinates(experiment),
    }
    coordinates = {name: LabeledArray((name,), values) for name, values in labels.items()}
    return RecordBatch(data, coordinates, attributes)


def _stack_genomes(saved_genomes: Sequence[Mapping[int, Genome]]) -> Genome:
    """Return saved genomes of several runs, [run, position, agent, module, weight].

    The positions after the last saved generation of a run have genomes of 0.
    """
    length = max(map(len, saved_genomes))
    first_genomes = next(iter(saved_genomes[0].values()))
    stacked = np.zeros((len(saved_genomes), length, *first_genomes.shape), first_genomes.dtype)
    for run, genomes_by_generation in enumerate(saved_genomes):
        for position, genomes in enumerate(genomes_by_generation.values()):
            stacked[run, position] = genomes
    return stacked


def stack_padded(arrays: Sequence[npt.NDArray[Any]], fill: int) -> npt.NDArray[Any]:
    """Stack arrays on a new first axis. Shorter arrays are padded with `fill` on the next axis."""
    lengths = {array.shape[:1] for array in arrays}
    if len(lengths) == 1:
        return _stack(arrays)
    shape = (len(arrays), *max(lengths), *arrays[0].shape[1:])
    padded = np.full(shape, fill, arrays[0].dtype)
    for row, array in zip(padded, arrays, strict=True):
        row[: len(array)] = array
    return padded


def _stack(arrays: Sequence[npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """Stack arrays of equal shape. A single array is not copied, to save memory for large runs."""
    return arrays[0][None] if len(arrays) == 1 else np.stack(arrays)


def _stack_run_arrays(arrays_of_runs: Sequence[SpeciesArrays]) -> dict[str, LabeledArray]:
    """Return the arrays of runs as variables, such as `run_array.0.KEY`. See `read_run_arrays`."""
    stacked: dict[str, LabeledArray] = {}
    for species, arrays in arrays_of_runs[0].items():
        for key, array in arrays.items():
            name = f"{variables.RUN_ARRAY_PREFIX}{species}.{key}"
            dims = [f"{name}_{axis}" for axis in range(array.ndim)]
            values = _stack([run_arrays[species][key] for run_arrays in arrays_of_runs])
            stacked[name] = LabeledArray((RUN_DIM, *dims), values)
    return stacked


def name_stop(history: History) -> str:
    """Return the name of the stop part that ended a run, or "" if the run was not stopped."""
    if not history.is_stopped:
        return ""
    return str(history.experiment.at(history.n_generations - 1).evolution.stop)


# All runs of a condition have the same experiment. Copying or formatting it takes a millisecond.
@lru_cache(maxsize=64)
def _shorten(experiment: BaseExperiment, n_generations: int) -> BaseExperiment:
    """Return the experiment with the number of generations of a history."""
    return experiment.replace(evolution={"generations": n_generations})


class _Layout(NamedTuple):
    """Properties of a record that are computed once per number of generations."""

    # The text of the experiment, with 0 generations.
    text: str
    declared: tuple[tuple[str, variables.Variable], ...]


class BatchKeys:
    """Keys of histories of one condition. Histories with equal keys can be in one batch."""

    def __init__(self) -> None:
        self._layouts: dict[int, _Layout] = {}

    def key(self, history: History) -> Hashable:
        """Return the key of a history: types and shapes of its arrays, and shared attributes."""
        layout = self._layouts.get(history.n_generations)
        if layout is None:
            layout = self._layouts[history.n_generations] = _make_layout(
                _shorten(history.experiment, history.n_generations)
            )
        recorded = [history.recorded_values(name) for name in history.recorded_names]
        genome = next(iter(history.saved_genomes.values()))
        run_arrays = [
            (species, key, array.shape, array.dtype)
            for species, arrays in history.stored_run_arrays.items()
            for key, array in arrays.items()
        ]
        # Only the first dimension of a netCDF variable can have the size 0. In a batch, this is the
        # run. The run in the key prevents a batch of several runs.
        has_empty_array = any(0 in shape for _, _, shape, _ in run_arrays)
        return (
            layout,
            history.run if has_empty_array else None,
            tuple(history.recorded_names),
            tuple((array.shape[1:], array.dtype) for array in (*recorded, genome)),
            tuple(run_arrays),
        )


@lru_cache(maxsize=64)
def _make_layout(experiment: BaseExperiment) -> _Layout:
    text = replace_generations(to_toml(experiment), 0)
    return _Layout(text, tuple(variables.record_variables(experiment).items()))


@lru_cache(maxsize=64)
def _shared_attributes(experiment: BaseExperiment, seed: int) -> dict[str, Any]:
    """Return the attributes of a batch: those that are required to reproduce its runs."""
    names = [species.name for species in experiment.population.species]
    species_names = {"species_names": ", ".join(names)} if names else {}
    return species_names | {
        "experiment": to_toml(experiment),
        "condition": experiment.name,
        "seed": seed,
        "weight_order": variables.describe_weight_order(experiment),
        "baldwinlab": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "platform": platform.platform(),
    }


def provenance_attributes(experiment: BaseExperiment, seed: int, run: int) -> dict[str, Any]:
    """Return the attributes that are required to reproduce a result: `run` follows `seed`."""
    attributes: dict[str, Any] = {}
    for name, value in _shared_attributes(experiment, seed).items():
        attributes[name] = value
        if name == "seed":
            attributes[RUN_DIM] = run
    return attributes
