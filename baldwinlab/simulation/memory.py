"""What lives will take, before the first is lived: memory and disk, in bytes.

It follows from what is declared: the arrays of a batch with their owners, and the recorded variables with their dimensions.
The numbers below are measured; tests hold the sums against what is really used. Of a model that is a part, whose lives allocate
what they like, genomes and records alone are known.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Final

import numpy as np

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.resources import NOTHING, Need, amount
from baldwinlab.core.variables import PARENTS, RECORD, Variable, of_record, of_trace
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.allocation import array_dimensions, state_bytes

ENGINE: Final = 200 * 2**20  # compiled code, and what compiles it
GENOMES: Final = (
    4  # copies of those of a batch: born, as they learn, what they learned, and their children's
)
STORING: Final = (
    4  # copies of a record while it is stored: its arrays, put together, as netCDF and as bytes
)
READING: Final = 3  # and while it is read
TRACING: Final = 3  # of a life that is written down
TABLES: Final = 3  # of all records without their genomes, while they are put together
A_RUN: Final = 64  # to have a run in a list of those to do
HEADER: Final = 2300  # of a file, beside its variables and its experiment
LARGEST: Final = 2**31 - 1  # of a variable in a netCDF file of version 3

Runs = Sequence[
    tuple[BaseExperiment, int]
]  # experiments, and how many runs of each are to be lived


def dimension_sizes(experiment: BaseExperiment) -> dict[str, int]:
    """The sizes of the dimensions of records and traces."""
    found = _of_record(experiment)
    if isinstance(experiment, Experiment):
        found |= {"step": experiment.lifetime.steps, "item": array_dimensions(experiment)["items"]}
        found |= {"side": len(experiment.inputs), "action": len(experiment.actions)}
    return found


def _of_record(experiment: BaseExperiment) -> dict[str, int]:
    """Those of records."""
    last, every = experiment.evolution.generations - 1, experiment.record.genome_every
    found = _of_table(experiment) | {
        "module": len(experiment.modules),
        "weight": experiment.genome_length,
    }
    found["kept_generation"] = last // every + 1 + (last % every > 0)
    return found


def _of_table(experiment: BaseExperiment) -> dict[str, int]:
    """Those that are known of any experiment, also where its parts are not here."""
    return {
        "generation": experiment.evolution.generations,
        "agent": experiment.population.size,
        "parent": len(PARENTS),
    }


def variable_bytes(declared: Mapping[str, Variable], there: Mapping[str, int]) -> dict[str, int]:
    """What each of these variables takes, with dimensions so large."""
    return {
        name: math.prod(there[dim] for dim in variable.dims) * np.dtype(variable.dtype).itemsize
        for name, variable in declared.items()
    }


def record_bytes(experiment: BaseExperiment) -> int:
    """What the variables of a stored run take."""
    return sum(variable_bytes(of_record(experiment), _of_record(experiment)).values())


def dataset_bytes(experiment: BaseExperiment) -> int:
    """What a run takes as `simulate` gives it: there is room for the genomes that are not kept, too."""
    there = dimension_sizes(experiment)
    return record_bytes(experiment) + (there["generation"] - there["kept_generation"]) * _genomes(
        experiment
    )


def _genomes(experiment: BaseExperiment) -> int:
    """What the genomes of one generation take."""
    return variable_bytes(
        {"genome": Variable(("agent", "module", "weight"), np.float32, "", "")},
        dimension_sizes(experiment),
    )["genome"]


def simulation_bytes(experiment: BaseExperiment, worlds: int) -> int:
    """Memory that a generation of so many runs side by side takes."""
    of_state = state_bytes(experiment, worlds) if isinstance(experiment, Experiment) else 0
    return of_state + GENOMES * worlds * _genomes(experiment)


def _batch(experiment: BaseExperiment, worlds: int) -> int:
    """Memory for so many runs side by side, from their first generation until they are stored."""
    return simulation_bytes(experiment, worlds) + (worlds + STORING) * record_bytes(experiment)


def estimate_simulation(experiment: BaseExperiment) -> Need:
    """One run, given as it is: to make it whole takes it twice."""
    return Need(
        ENGINE
        + simulation_bytes(experiment, 1)
        + record_bytes(experiment)
        + 2 * dataset_bytes(experiment)
    )


def estimate_runs(wanted: Runs, workers: int, worlds: int) -> Need:
    """Runs that are stored, on so many threads, in batches of at most so many worlds: `studies.study.plan` plans them."""
    total = sum(runs for _, runs in wanted)
    if not total:
        return NOTHING
    size = max(1, min(worlds, total // workers))
    memory = largest_total(
        [(_batch(one, min(size, runs)), -(-runs // size)) for one, runs in wanted if runs], workers
    )
    header = HEADER + len(to_toml(wanted[0][0]).encode())  # those of a study are about as long
    disk = sum(
        runs * (record_bytes(one) + header) + header for one, runs in wanted
    )  # of each, its experiment by itself, too
    return Need(ENGINE + memory + A_RUN * total, disk)


def largest_total(tasks: Iterable[tuple[int, int]], workers: int) -> int:
    """The most that so many tasks at a time take, of (what one takes, how many there are)."""
    memory = 0
    for bytes_of_one, number in sorted(tasks, reverse=True):
        memory += bytes_of_one * min(number, workers)
        workers -= min(number, workers)
    return memory


def estimate_tables(stored: Runs) -> Need:
    """All runs of a study but for their genomes as one dataset, in which each has room for the longest and the largest."""
    declared = {name: variable for name, variable in RECORD.items() if name != "kept_genome"}
    there = [one for one, runs in stored if runs]
    longest = max(
        (sum(variable_bytes(declared, _of_table(one)).values()) for one in there), default=0
    )
    read = 0
    with suppress(ExperimentError):  # where parts are not here, nothing is known of genomes
        read = max(map(record_bytes, there), default=0)
    return Need(TABLES * longest * sum(runs for _, runs in stored) + READING * read)


def estimate_replay(experiment: Experiment, lives: int = 1) -> Need:
    """So many lives that are written down, every step, and one of them stored."""
    trace = sum(variable_bytes(of_trace(experiment), dimension_sizes(experiment)).values())
    return Need(
        ENGINE + simulation_bytes(experiment, 1) + (lives + TRACING) * trace, trace + HEADER
    )


def require_storable(declared: Mapping[str, Variable], there: Mapping[str, int], what: str) -> None:
    """Raises RefusedError where a variable is larger than its file may have it, however large the machine."""
    for name, taken in variable_bytes(declared, there).items():
        if taken > LARGEST:
            raise RefusedError(
                f"{what}: {name} would take {amount(taken)}, and netCDF files hold at most 2 GiB of a variable"
            )
