"""Estimates of the memory and disk space that simulations need, in bytes.

An estimate is the size of the declared arrays of a batch and of the recorded variables. The
constants below are measured, and tests compare the estimates with the actual use. For a model other
than MiniWorld, an estimate excludes the memory of lifetimes, which is unknown.
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
    TIME_SERIES_VARIABLES,
    Variable,
    record_variables,
    trace_variables,
    window_coordinates,
)
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.miniworld import count_worlds
from baldwinlab.experiment.species import ACROSS, combine_inputs
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.allocation import array_dimensions, state_bytes
from baldwinlab.models.miniworld.backends.cpu import BLOCK_WORLDS, is_large

# Memory of compiled code and of the compiler.
ENGINE_BYTES: Final = 200 * 2**20
# Copies of the genomes of a batch: at birth, during learning, after learning, and of the offspring.
GENOME_COPIES: Final = 4
# Copies of a record during storage: arrays, dataset, netCDF and bytes.
STORED_RECORD_COPIES: Final = 4
# Copies of a record during reading.
READ_RECORD_COPIES: Final = 3
# Copies of a trace during recording.
TRACE_COPIES: Final = 3
# Copies of all records without genomes during the concatenation of records.
TABLE_COPIES: Final = 3
# Memory of the bootstrap resamples of a run in a comparison of conditions, and the maximum for all
# runs. The maximum exists because large samples are resampled in batches.
RESAMPLED_RUN_BYTES: Final = 250_000
MAX_RESAMPLED_BYTES: Final = 200 * 2**20
# Memory of a run in a list of tasks.
RUN_BYTES: Final = 64
# Bytes of a file without the variables and without the text of the experiment.
HEADER_BYTES: Final = 2300
# Maximum size of a variable in a netCDF file of version 3, in bytes.
MAX_VARIABLE_BYTES: Final = 2**31 - 1

# Maximum agent-steps of a file of records, because a killed process loses the runs that are not yet
# stored. Maximum bytes, because a file is read as a whole. Maximum number of runs. A batch with
# fewer runs than the minimum saves no time.
MAX_STEPS_PER_FILE: Final = 5_000_000
MAX_BYTES_PER_FILE: Final = 64 * 2**20
MAX_RUNS_PER_FILE: Final = 1000
MIN_RUNS_PER_BATCH: Final = 16
# Maximum agents and maximum bytes of the records of the runs that evolve together, for each world
# of the backend. Batches of larger runs have fewer runs, because they would save little time, and
# would report their progress less often.
MAX_AGENTS_PER_WORLD: Final = 32
MAX_RECORD_BYTES_PER_WORLD: Final = 2**20
# With several tasks per worker, all workers end at about the same time.
TASKS_PER_WORKER: Final = 4
# A task has at least this share of the worlds of the backend, because smaller batches are slower.
MIN_SHARE_OF_WORLDS: Final = 1 / 16

# Pairs of an experiment and a number of runs.
PlannedRuns = Sequence[tuple[BaseExperiment, int]]


def dimension_sizes(experiment: BaseExperiment) -> dict[str, int]:
    """Return the sizes of the dimensions of records and traces."""
    sizes = _record_sizes(experiment)
    if isinstance(experiment, Experiment):
        sizes["step"] = experiment.lifetime.steps
        sizes["item"] = array_dimensions(experiment)["items"]
        members = experiment.species_experiments() or (experiment,)
        inputs, _ = combine_inputs([member.inputs for member in members])
        sizes["side"] = len(inputs)
        sizes["action"] = max(len(member.actions) for member in members)
    return sizes


def _record_sizes(experiment: BaseExperiment) -> dict[str, int]:
    """Return the sizes of the dimensions of records."""
    last_generation = experiment.evolution.generations - 1
    interval = experiment.record.genome_every
    # Genomes are stored in the generations 0, interval, 2 * interval, ..., and in the last one.
    n_regular = last_generation // interval + 1
    is_last_extra = last_generation % interval > 0
    sizes = _table_sizes(experiment)
    sizes["module"] = len(experiment.modules)
    sizes["weight"] = experiment.genome_length
    sizes["kept_generation"] = n_regular + int(is_last_extra)
    return sizes


def _table_sizes(experiment: BaseExperiment) -> dict[str, int]:
    """Return the sizes of the dimensions that are known without the parts of the experiment."""
    return {
        "generation": experiment.evolution.generations,
        "agent": experiment.population.size,
        "parent": len(PARENT_NAMES),
        **{dim: len(values) for dim, values in window_coordinates(experiment).items()},
    }


def variable_bytes(declared: Mapping[str, Variable], sizes: Mapping[str, int]) -> dict[str, int]:
    """Return the bytes of each variable for the sizes of its dimensions."""
    n_bytes = {}
    for name, variable in declared.items():
        n_values = math.prod(sizes[dim] for dim in variable.dims)
        n_bytes[name] = n_values * np.dtype(variable.dtype).itemsize
    return n_bytes


def record_bytes(experiment: BaseExperiment) -> int:
    """Return the bytes of all variables of a record."""
    return sum(variable_bytes(record_variables(experiment), _record_sizes(experiment)).values())


def runs_per_file(experiment: BaseExperiment) -> int:
    """Return the number of runs in a file of records. A large run has its own file."""
    agent_steps = experiment.evolution.generations * experiment.agent_steps
    n_runs = min(
        MAX_RUNS_PER_FILE,
        MAX_STEPS_PER_FILE // agent_steps,
        MAX_BYTES_PER_FILE // record_bytes(experiment),
    )
    return n_runs if n_runs >= MIN_RUNS_PER_BATCH else 1


def count_batch_runs(experiment: BaseExperiment, worlds: int) -> int:
    """Return the number of runs that evolve together on a backend with `worlds` worlds."""
    repeats = 1
    if isinstance(experiment, Experiment):
        # All threads of a task simulate one large world.
        if is_large(experiment, count_worlds(experiment)):
            return 1
        # Each repeat of a lifetime has its own world.
        repeats = experiment.lifetime.repeats
    n_runs = min(
        worlds // repeats,
        worlds * MAX_AGENTS_PER_WORLD // (repeats * experiment.population.size),
        worlds * MAX_RECORD_BYTES_PER_WORLD // record_bytes(experiment),
    )
    return max(1, n_runs)


def count_separate_workers(
    experiment: BaseExperiment, total_runs: int, workers: int, *, has_shared_threads: bool
) -> int:
    """Return the number of workers that need their own tasks, to use all cores.

    It is 1 if all tasks share the threads of one process, and the blocks of worlds of all runs are
    enough for these threads. `total_runs`: the runs of all experiments.
    """
    has_blocks = (
        isinstance(experiment, Experiment)
        and not experiment.population.species
        and not is_large(experiment, count_worlds(experiment))
    )
    is_enough = total_runs >= BLOCK_WORLDS * workers
    return 1 if has_shared_threads and has_blocks and is_enough else workers


def count_task_runs(experiment: BaseExperiment, total_runs: int, workers: int, worlds: int) -> int:
    """Return the number of runs of an experiment in a task.

    It is the number of runs of a batch, or less if the workers would have less than
    `TASKS_PER_WORKER` tasks. `total_runs`: the runs of all experiments. `workers`: the result of
    `count_separate_workers`.
    """
    min_runs = int(worlds * MIN_SHARE_OF_WORLDS)
    balanced_runs = max(min_runs, total_runs // (workers * TASKS_PER_WORKER))
    n_runs = min(count_batch_runs(experiment, worlds), balanced_runs, total_runs // workers)
    return max(1, n_runs)


def dataset_bytes(experiment: BaseExperiment) -> int:
    """Return the bytes of a dataset from `simulate`, which has the genomes of all generations."""
    sizes = dimension_sizes(experiment)
    omitted_generations = sizes["generation"] - sizes["kept_generation"]
    return record_bytes(experiment) + omitted_generations * _genome_bytes(experiment)


def _genome_bytes(experiment: BaseExperiment) -> int:
    """Return the bytes of the genomes of one generation."""
    dims = ("agent", "module", "weight")
    genome = Variable(dims, np.float32, unit="", meaning="")
    return variable_bytes({"genome": genome}, dimension_sizes(experiment))["genome"]


def simulation_bytes(experiment: BaseExperiment, n_worlds: int) -> int:
    """Return the memory for a generation of `n_worlds` parallel runs."""
    members = experiment.species_experiments() or (experiment,)
    # With competition across species, one species can grow to the entire population.
    size = {"size": experiment.population.size}
    if experiment.evolution.compete == ACROSS:
        members = tuple(member.replace(population=size) for member in members)
    n_lifetimes = n_worlds
    if isinstance(experiment, Experiment):
        # Each repeat of a lifetime has a copy of the genomes.
        n_lifetimes *= experiment.lifetime.repeats
    world_bytes = sum(
        state_bytes(member, n_worlds * count_worlds(member))
        for member in members
        if isinstance(member, Experiment)
    )
    return world_bytes + GENOME_COPIES * n_lifetimes * _genome_bytes(experiment)


def _task_bytes(experiment: BaseExperiment, n_runs: int, worlds: int) -> int:
    """Return the memory of a task, which simulates `n_runs` runs in batches and stores them."""
    batch_runs = min(count_batch_runs(experiment, worlds), n_runs)
    file_runs = min(runs_per_file(experiment), n_runs)
    # The records of a batch are in memory until all its runs are stored. Up to `file_runs` - 1 runs
    # of earlier batches wait until a file is full.
    n_waiting_batches = math.ceil((file_runs - 1) / batch_runs)
    n_records = min((n_waiting_batches + 1) * batch_runs, n_runs)
    # A task stores one file at a time. Before, it may have read the stored generations of a batch.
    n_copies = max(STORED_RECORD_COPIES * file_runs, READ_RECORD_COPIES + batch_runs)
    record_memory = (n_records + n_copies) * record_bytes(experiment)
    return simulation_bytes(experiment, batch_runs) + record_memory


def estimate_simulation(experiment: BaseExperiment) -> Need:
    """Estimate a run that `simulate` returns. The conversion to a dataset needs a second copy."""
    dataset_copies = 2
    return Need(
        ENGINE_BYTES
        + simulation_bytes(experiment, n_worlds=1)
        + record_bytes(experiment)
        + dataset_copies * dataset_bytes(experiment)
    )


def estimate_runs(
    planned: PlannedRuns, workers: int, worlds: int, *, has_shared_threads: bool = False
) -> Need:
    """Estimate the memory and disk space of runs that are simulated in batches and stored.

    `has_shared_threads`: whether all tasks share the threads of one process.
    """
    total_runs = sum(n_runs for _, n_runs in planned)
    if not total_runs:
        return NO_NEED
    tasks = []
    for experiment, n_runs in planned:
        if n_runs:
            n_workers = count_separate_workers(
                experiment, total_runs, workers, has_shared_threads=has_shared_threads
            )
            task_runs = count_task_runs(experiment, total_runs, n_workers, worlds)
            largest_task = min(total_runs // n_workers or 1, n_runs)
            n_bytes = _task_bytes(experiment, largest_task, worlds)
            tasks.append((n_bytes, math.ceil(n_runs / task_runs)))
    memory = largest_total(tasks, workers)
    # The texts of all experiments of a study have about the same length.
    first_experiment, _ = planned[0]
    header_bytes = HEADER_BYTES + len(to_toml(first_experiment).encode())
    disk = 0
    for experiment, n_runs in planned:
        # A few runs have a file each.
        runs_of_file = runs_per_file(experiment) if n_runs >= MIN_RUNS_PER_BATCH else 1
        n_files = math.ceil(n_runs / runs_of_file)
        disk += n_runs * record_bytes(experiment) + n_files * header_bytes
        # A study also stores each experiment in a separate file.
        disk += header_bytes
    return Need(ENGINE_BYTES + memory + RUN_BYTES * total_runs, disk)


def largest_total(tasks: Iterable[tuple[int, int]], workers: int) -> int:
    """Return the memory of the `workers` largest tasks, which can run at the same time.

    `tasks`: pairs of the bytes of a task and the number of such tasks.
    """
    memory = 0
    idle_workers = workers
    for task_bytes, n_tasks in sorted(tasks, reverse=True):
        n_parallel = min(n_tasks, idle_workers)
        memory += task_bytes * n_parallel
        idle_workers -= n_parallel
    return memory


def estimate_tables(stored: PlannedRuns) -> Need:
    """Estimate the comparison of stored runs in one dataset without genomes.

    All runs in the dataset have the size of the largest run, because shorter runs are padded.
    """
    declared = {
        name: variable for name, variable in RECORD_VARIABLES.items() if name != "kept_genome"
    }
    experiments = [experiment for experiment, n_runs in stored if n_runs]
    table_bytes = []
    for experiment in experiments:
        sizes = _table_sizes(experiment)
        has_series = "window" in sizes
        variables = declared | dict(TIME_SERIES_VARIABLES) if has_series else declared
        table_bytes.append(sum(variable_bytes(variables, sizes).values()))
    largest_record_bytes = 0
    # If a part is not loaded, the size of a genome is unknown, and records count as 0 bytes.
    with suppress(ExperimentError):
        largest_record_bytes = max(map(record_bytes, experiments), default=0)
    total_runs = sum(n_runs for _, n_runs in stored)
    all_tables_bytes = total_runs * max(table_bytes, default=0)
    resampled_bytes = min(RESAMPLED_RUN_BYTES * total_runs, MAX_RESAMPLED_BYTES)
    return Need(
        TABLE_COPIES * all_tables_bytes
        + READ_RECORD_COPIES * largest_record_bytes
        + resampled_bytes
    )


def estimate_replay(experiment: Experiment, n_lives: int = 1) -> Need:
    """Estimate the memory of `n_lives` traces, and the disk space of one stored trace.

    A trace has the agents of one world.
    """
    sizes = dimension_sizes(experiment) | {"agent": experiment.agents_per_world}
    trace_bytes = sum(variable_bytes(trace_variables(experiment), sizes).values())
    n_traces = n_lives + TRACE_COPIES
    memory = ENGINE_BYTES + simulation_bytes(experiment, n_worlds=1) + n_traces * trace_bytes
    return Need(memory, disk=trace_bytes + HEADER_BYTES)


def require_storable_record(experiment: BaseExperiment) -> None:
    """Raise RefusedError if a variable of a record exceeds the limit of a netCDF file."""
    require_storable(record_variables(experiment), _record_sizes(experiment), experiment.name)


def require_storable(
    declared: Mapping[str, Variable], sizes: Mapping[str, int], subject: str
) -> None:
    """Raise RefusedError if a variable exceeds the limit of a netCDF file.

    `subject` is the beginning of the message.
    """
    for name, n_bytes in variable_bytes(declared, sizes).items():
        if n_bytes > MAX_VARIABLE_BYTES:
            raise RefusedError(
                f"{subject}: {name} would take {format_bytes(n_bytes)}, "
                "and netCDF files hold at most 2 GiB of a variable"
            )
