"""Checks of the content of a file of records: its origin, its variables and its genomes."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.records import KEPT_GENERATIONS, RUN_DIM
from baldwinlab.core.variables import (
    COMMON_RECORD_VARIABLES,
    GENERATION_COUNT,
    RECORD_VARIABLES,
    STOP_ATTRIBUTE,
)
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.toml import from_toml
from baldwinlab.studies.record_files import RecordFile, StudyError

# Codes of the NumPy types of integers and floating-point numbers.
NUMERIC_KIND_CODES: Final = ("i", "f")

Variables = Mapping[Hashable, "xr.Variable"]


class DamagedRecordError(StudyError):
    """Damaged record: its content differs from its checksum."""


class RunLengths(NamedTuple):
    """Lengths of the runs in a file of records."""

    n_generations: npt.NDArray[np.int32]
    is_stopped: npt.NDArray[np.bool_]  # Whether the stop part has ended the run.


def require_content(
    attributes: Mapping[Any, Any],
    variables: Variables,
    file: RecordFile,
    experiment: BaseExperiment,
    seed: int,
) -> RunLengths:
    """Check that a file has the records of its runs, and return their lengths."""
    fields = _require_origin(attributes, variables, file, experiment, seed)
    # After an extension of the study, this is less than the number of generations of the study.
    n_generations = fields["evolution"]["generations"]
    run_shape = (len(file.runs),) if file.is_batch else ()
    is_complete = all(
        _is_declared(name, variables, file.is_batch) for name in COMMON_RECORD_VARIABLES
    )
    shape = (*run_shape, n_generations, experiment.population.size)
    if not is_complete or variables["energy"].shape != shape:
        runs = f" of {len(file.runs)} runs" if file.is_batch else ""
        raise DamagedRecordError(
            f"it does not contain the variables of {n_generations} generations of "
            f"{experiment.population.size} agents{runs}"
        )
    if not file.is_batch:
        lengths = RunLengths(
            np.array([n_generations], np.int32), np.array([STOP_ATTRIBUTE in attributes])
        )
        kept_generations = variables["kept_generation"].values[None]
    else:
        lengths = _read_lengths(variables, n_generations)
        kept_generations = variables[KEPT_GENERATIONS].values
    _require_kept_generations(kept_generations, lengths.n_generations, experiment)
    return lengths


def _require_origin(
    attributes: Mapping[Any, Any],
    variables: Variables,
    file: RecordFile,
    experiment: BaseExperiment,
    seed: int,
) -> dict[str, Any]:
    """Check the condition, seed, runs and experiment, and return the fields of the experiment."""
    condition = str(attributes.get("condition", ""))
    stored_seed = str(attributes.get("seed", ""))
    if file.is_batch:
        stored_runs = variables[RUN_DIM].values.tolist() if RUN_DIM in variables else []
        name = f"runs {stored_runs[0]} to {stored_runs[-1]}" if stored_runs else "no runs"
        is_same = stored_runs == list(file.runs)
    else:
        name = f"run {attributes.get('run', '')}"
        is_same = name == f"run {file.first}"
    if not is_same or (condition, stored_seed) != (experiment.name, str(seed)):
        origin = f"{name} of {condition} with seed {stored_seed}" if condition else "of no study"
        verb = "belong" if file.is_batch else "belongs"
        raise DamagedRecordError(
            f"it is {origin}, and {file} of {experiment.name} with seed {seed} {verb} there"
        )
    fields = parse_fields(str(attributes.get("experiment", "")), type(experiment))
    if not _is_same_run(fields, experiment.to_dict()):
        raise DamagedRecordError(
            f"the experiment that it was made with is not that of {experiment.name} in this study"
        )
    return fields


def _is_same_run(fields: dict[str, Any], study_fields: dict[str, Any]) -> bool:
    """Return whether a record has the experiment of its study, possibly with fewer generations."""
    if fields == study_fields:
        return True
    generations = fields["evolution"]["generations"]
    study_evolution = study_fields["evolution"]
    if not 1 <= generations < study_evolution["generations"]:
        return False
    shortened_evolution = study_evolution | {"generations": generations}
    return fields == study_fields | {"evolution": shortened_evolution}


@lru_cache(maxsize=64)
def parse_fields(text: str, read_as: type[BaseExperiment]) -> dict[str, Any]:
    """Return the fields of the experiment of a record.

    The experiment is parsed once for all runs of a condition. Its class depends on the loaded
    parts, so `read_as`, the class of the study's experiment, is a part of the key of the cache.
    """
    return from_toml(text, source="its experiment", lenient=True).to_dict()


def _is_declared(name: str, variables: Variables, is_batch: bool) -> bool:
    """Return whether a file has a numeric variable with its dimensions and coordinates."""
    variable = variables.get(name)
    dims = RECORD_VARIABLES[name].dims
    labeled_dims = {*variables}
    if is_batch:
        dims = (RUN_DIM, *dims)
        # The generations of the genomes differ between the runs.
        labeled_dims.add("kept_generation")
    return (
        variable is not None
        and variable.dims == dims
        and variable.dtype.kind in NUMERIC_KIND_CODES
        and {*dims} <= labeled_dims
    )


def _read_lengths(variables: Variables, n_generations: int) -> RunLengths:
    """Return the lengths of the runs of a batch whose longest run has `n_generations`."""
    n_runs = variables["energy"].sizes[RUN_DIM]
    counts = variables.get(GENERATION_COUNT)
    kept_generations = variables.get(KEPT_GENERATIONS)
    if (
        counts is None
        or kept_generations is None
        or counts.shape != (n_runs,)
        or kept_generations.dims != (RUN_DIM, "kept_generation")
        or counts.values.min() < 1
        or counts.values.max() != n_generations
    ):
        raise DamagedRecordError("it does not contain the numbers of generations of its runs")
    is_stopped = np.zeros(n_runs, np.bool_)
    if STOP_ATTRIBUTE in variables:
        names = variables[STOP_ATTRIBUTE].values
        # A stored text is an array of characters.
        is_stopped = (names.astype(str) != "").reshape(n_runs, -1).any(axis=1)
    return RunLengths(counts.values.astype(np.int32), is_stopped)


def _require_kept_generations(
    kept_generations: npt.NDArray[Any],
    n_generations: npt.NDArray[np.int32],
    experiment: BaseExperiment,
) -> None:
    """Check that the genomes of each run are those of its generations."""
    interval = experiment.record.genome_every
    for length in np.unique(n_generations).tolist():
        expected = [
            generation
            for generation in range(length)
            if generation % interval == 0 or generation == length - 1
        ]
        rows = kept_generations[n_generations == length]
        is_padding = rows[:, len(expected) :] == -1
        stored = rows[:, : len(expected)]
        if stored.tolist() != [expected] * len(stored) or not is_padding.all():
            raise DamagedRecordError(
                f"the generations of its genomes are not those of record.genome_every = {interval}"
            )
