"""Estimates of the memory and disk space of simulations before they start, in bytes.

The estimate is derived from the declared arrays of a batch and the recorded variables. The
constants below are measured, and tests compare the estimates with the actual use. The estimate for
a third-party model contains only its genomes and records, because its lifetimes can allocate other
memory.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Final

import numpy as np

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.resources import NO_NEED, Need, format_bytes
from baldwinlab.core.variables import (
    PARENT_NAMES,
    RECORD_VARIABLES,
    Variable,
    record_variables,
    trace_variables,
)
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.allocation import array_dimensions, state_bytes

# Bytes of compiled code and of the compiler.
ENGINE_BYTES: Final = 200 * 2**20
# Copies of the genomes of a batch: at birth, during learning, after learning, and of the offspring.
GENOME_COPIES: Final = 4
# Copies of a record while it is stored: arrays, dataset, netCDF and bytes.
STORED_RECORD_COPIES: Final = 4
# Copies of a record while it is read.
READ_RECORD_COPIES: Final = 3
# Copies of a trace while it is recorded.
TRACE_COPIES: Final = 3
# Copies of all records without genomes while they are concatenated.
TABLE_COPIES: Final = 3
# Bytes of a run in a list of tasks.
RUN_BYTES: Final = 64
# Bytes of a file in addition to its variables and its experiment.
HEADER_BYTES: Final = 2300
# Maximum size of a variable in a netCDF file of version 3, in bytes.
MAX_VARIABLE_BYTES: Final = 2**31 - 1

# Experiments, each with its number of runs.
PlannedRuns = Sequence[tuple[BaseExperiment, int]]


def dimension_sizes(experiment: BaseExperiment) -> dict[str, int]:
    """Return the sizes of the dimensions of records and traces."""
    sizes = _record_sizes(experiment)
    if isinstance(experiment, Experiment):
        sizes |= {"step": experiment.lifetime.steps, "item": array_dimensions(experiment)["items"]}
        sizes |= {"side": len(experiment.inputs), "action": len(experiment.actions)}
    return sizes


def _record_sizes(experiment: BaseExperiment) -> dict[str, int]:
    """Return the sizes of the dimensions of records."""
    last = experiment.evolution.generations - 1
    every = experiment.record.genome_every
    sizes = _table_sizes(experiment)
    sizes["module"] = len(experiment.modules)
    sizes["weight"] = experiment.genome_length
    sizes["kept_generation"] = last // every + 1 + (last % every > 0)
    return sizes


def _table_sizes(experiment: BaseExperiment) -> dict[str, int]:
    """Return the sizes that do not depend on loaded parts."""
    return {
        "generation": experiment.evolution.generations,
        "agent": experiment.population.size,
        "parent": len(PARENT_NAMES),
    }


def variable_bytes(declared: Mapping[str, Variable], sizes: Mapping[str, int]) -> dict[str, int]:
    """Return the bytes of each variable for the sizes of its dimensions."""
    return {
        name: math.prod(sizes[dim] for dim in variable.dims) * np.dtype(variable.dtype).itemsize
        for name, variable in declared.items()
    }


def record_bytes(experiment: BaseExperiment) -> int:
    """Return the bytes of the variables of a record."""
    return sum(variable_bytes(record_variables(experiment), _record_sizes(experiment)).values())


def dataset_bytes(experiment: BaseExperiment) -> int:
    """Return the bytes of a run with the genomes of all generations, as `simulate` returns it."""
    sizes = dimension_sizes(experiment)
    omitted_generations = sizes["generation"] - sizes["kept_generation"]
    return record_bytes(experiment) + omitted_generations * _genome_bytes(experiment)


def _genome_bytes(experiment: BaseExperiment) -> int:
    """Return the bytes of the genomes of one generation."""
    return variable_bytes(
        {"genome": Variable(("agent", "module", "weight"), np.float32, "", "")},
        dimension_sizes(experiment),
    )["genome"]


def simulation_bytes(experiment: BaseExperiment, worlds: int) -> int:
    """Return the memory for a generation of `worlds` parallel runs."""
    bytes_of_state = state_bytes(experiment, worlds) if isinstance(experiment, Experiment) else 0
    return bytes_of_state + GENOME_COPIES * worlds * _genome_bytes(experiment)


def _batch_bytes(experiment: BaseExperiment, worlds: int) -> int:
    """Return the memory for the simulation and the storage of `worlds` parallel runs."""
    return simulation_bytes(experiment, worlds) + (worlds + STORED_RECORD_COPIES) * record_bytes(
        experiment
    )


def estimate_simulation(experiment: BaseExperiment) -> Need:
    """Estimate one run that is returned as a dataset; the conversion needs a second copy."""
    return Need(
        ENGINE_BYTES
        + simulation_bytes(experiment, 1)
        + record_bytes(experiment)
        + 2 * dataset_bytes(experiment)
    )


def estimate_runs(planned: PlannedRuns, workers: int, worlds: int) -> Need:
    """Estimate the memory and disk space of runs that are simulated in batches and stored.

    Parameters
    ----------
    planned : sequence of (BaseExperiment, int)
        Experiments, each with its number of runs.
    workers : int
        Number of batches that are simulated in parallel.
    worlds : int
        Maximum number of runs in a batch.

    Returns
    -------
    Need
        Memory and disk space in bytes.
    """
    total = sum(runs for _, runs in planned)
    if not total:
        return NO_NEED
    size = max(1, min(worlds, total // workers))
    tasks = [
        (_batch_bytes(experiment, min(size, runs)), -(-runs // size))
        for experiment, runs in planned
        if runs
    ]
    memory = largest_total(tasks, workers)
    # All experiments of a study have about the same length.
    header = HEADER_BYTES + len(to_toml(planned[0][0]).encode())
    # A study also stores each experiment in a separate file.
    disk = sum(runs * (record_bytes(experiment) + header) + header for experiment, runs in planned)
    return Need(ENGINE_BYTES + memory + RUN_BYTES * total, disk)


def largest_total(tasks: Iterable[tuple[int, int]], workers: int) -> int:
    """Return the maximum memory of parallel tasks.

    Parameters
    ----------
    tasks : iterable of (int, int)
        Bytes of a task, and the number of such tasks.
    workers : int
        Number of tasks that are executed in parallel.
    """
    memory = 0
    for task_bytes, number in sorted(tasks, reverse=True):
        memory += task_bytes * min(number, workers)
        workers -= min(number, workers)
    return memory


def estimate_tables(stored: PlannedRuns) -> Need:
    """Estimate one dataset of all stored runs without genomes, padded to the largest run."""
    declared = {
        name: variable for name, variable in RECORD_VARIABLES.items() if name != "kept_genome"
    }
    experiments = [experiment for experiment, runs in stored if runs]
    tables = [
        sum(variable_bytes(declared, _table_sizes(experiment)).values())
        for experiment in experiments
    ]
    largest_record = 0
    # The size of a genome is unknown if a part is not loaded.
    with suppress(ExperimentError):
        largest_record = max(map(record_bytes, experiments), default=0)
    total_runs = sum(runs for _, runs in stored)
    return Need(
        TABLE_COPIES * max(tables, default=0) * total_runs + READ_RECORD_COPIES * largest_record
    )


def estimate_replay(experiment: Experiment, lives: int = 1) -> Need:
    """Estimate the traces of `lives` lifetimes. The trace of one lifetime is stored."""
    trace = sum(variable_bytes(trace_variables(experiment), dimension_sizes(experiment)).values())
    return Need(
        ENGINE_BYTES + simulation_bytes(experiment, 1) + (lives + TRACE_COPIES) * trace,
        trace + HEADER_BYTES,
    )


def require_storable(declared: Mapping[str, Variable], sizes: Mapping[str, int], what: str) -> None:
    """Raise RefusedError if a variable exceeds the limit of a netCDF file."""
    for name, size in variable_bytes(declared, sizes).items():
        if size > MAX_VARIABLE_BYTES:
            raise RefusedError(
                f"{what}: {name} would take {format_bytes(size)}, "
                "and netCDF files hold at most 2 GiB of a variable"
            )
