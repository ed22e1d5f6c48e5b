"""Storage of many tiny runs: `python -m benchmarks.storage [RUNS ...]`.

The command compares one file per run, batches of runs, and Zarr version 3 with shards of as many
runs as a batch. A run has 2 generations of 4 agents with 20 steps, so that storage is most of the
work. Histories are simulated once, and their numbers are changed, so the times are those of storage
alone. CPU time changes little if other processes run.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

import numpy as np
import xarray as xr
import zarr

from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import load
from baldwinlab.simulation import memory
from baldwinlab.simulation.history import History
from baldwinlab.simulation.records import make_batch
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.record_writer import RecordWriter
from baldwinlab.studies.run import find_missing_runs
from benchmarks.tables import table

EXPERIMENT: Experiment = load("evo/A").replace(
    evolution={"generations": 2}, lifetime={"steps": 20}, population={"size": 4}
)
SEED = 1
BATCH = memory.MAX_RUNS_PER_FILE
# A chunk of Zarr is the unit of compression. A shard has many chunks.
CHUNK = 100
# The other formats take too long for more runs.
MAX_RUNS = {"one file per run": 1_000, "batches": 10_000_000, "Zarr, sharded": 100_000}
MILLISECONDS = 1000
MIB = 2**20


class Cost(NamedTuple):
    """Costs of one format: milliseconds per run, bytes per run, files, and memory in MiB.

    `write_wall` includes the time for the disk. The other times are CPU times. `memory` is the
    growth of the process when the study is opened.
    """

    write_wall: float
    write: float
    resume: float
    open: float
    n_bytes: float
    n_files: int
    memory: float


class Stopwatch:
    """Wall and CPU time of a block, in seconds."""

    wall = 0.0
    cpu = 0.0


@contextmanager
def stopwatch() -> Iterator[Stopwatch]:
    times = Stopwatch()
    wall, cpu = time.perf_counter(), time.process_time()
    yield times
    times.wall, times.cpu = time.perf_counter() - wall, time.process_time() - cpu


def renumber(histories: Sequence[History], n_runs: int) -> Iterator[list[History]]:
    """Yield batches of `n_runs` histories with consecutive numbers."""
    for start in range(0, n_runs, len(histories)):
        batch = list(histories[: n_runs - start])
        for index, history in enumerate(batch):
            history.run = start + index
        yield batch


def measure_study(histories: Sequence[History], n_runs: int, runs_per_file: int) -> Cost:
    """Measure the files of a study."""
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name) / "study"
        study = create_study(directory, [EXPERIMENT], SEED)
        with patch.object(memory, "MAX_RUNS_PER_FILE", runs_per_file), stopwatch() as write:
            writer = RecordWriter(directory, EXPERIMENT)
            for batch in renumber(histories, n_runs):
                for history in batch:
                    writer.add(history, has_checkpoint=False)
                # The histories are used again for the next runs.
                writer.flush()
        with stopwatch() as resume:
            missing = find_missing_runs(study, n_runs, print)
        if any(missing.values()):
            raise AssertionError(f"{missing} runs are missing")
        before = read_resident_mib()
        with stopwatch() as opening:
            data = open_runs(directory)
        memory_of_data = read_resident_mib() - before
        del data
        return summarize(directory, n_runs, (write, resume, opening), memory_of_data)


def measure_zarr(histories: Sequence[History], n_runs: int) -> Cost:
    """Measure arrays of Zarr with one shard per batch of runs."""
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name) / "study.zarr"
        with stopwatch() as write:
            group = zarr.open_group(directory, mode="w", zarr_format=3)
            for batch in renumber(histories, n_runs):
                write_shard(group, make_batch(batch), n_runs)
        with stopwatch() as resume:
            # Each chunk has a checksum (CRC32C), which is verified when the values are read.
            for _, array in zarr.open_group(directory, mode="r").arrays():
                array[:]
        before = read_resident_mib()
        with stopwatch() as opening, closing(xr.open_zarr(directory, consolidated=False)):
            pass
        memory_of_data = read_resident_mib() - before
        return summarize(directory, n_runs, (write, resume, opening), memory_of_data)


def write_shard(group: zarr.Group, batch: xr.Dataset, n_runs: int) -> None:
    first = int(batch["run"].values[0])
    for name, variable in batch.data_vars.items():
        if str(name) not in group:
            shape = variable.shape[1:]
            group.create_array(
                str(name),
                shape=(n_runs, *shape),
                dtype=variable.dtype,
                shards=(BATCH, *shape),
                chunks=(CHUNK, *shape),
                dimension_names=[str(dim) for dim in variable.dims],
            )
        array = group[str(name)]
        assert isinstance(array, zarr.Array)
        array[first : first + len(batch["run"])] = np.asarray(variable.values)


def read_resident_mib() -> float:
    """Return the resident memory of this process (Linux)."""
    n_pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return n_pages * resource.getpagesize() / MIB


def summarize(
    directory: Path,
    n_runs: int,
    times: tuple[Stopwatch, Stopwatch, Stopwatch],
    memory_of_data: float,
) -> Cost:
    write, resume, opening = times
    sizes = [path.stat().st_size for path in directory.rglob("*") if path.is_file()]
    return Cost(
        write_wall=write.wall / n_runs * MILLISECONDS,
        write=write.cpu / n_runs * MILLISECONDS,
        resume=resume.cpu / n_runs * MILLISECONDS,
        open=opening.cpu / n_runs * MILLISECONDS,
        n_bytes=sum(sizes) / n_runs,
        n_files=len(sizes),
        memory=memory_of_data,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="*", type=int, default=[100, 10_000, 100_000])
    histories = simulate_histories(EXPERIMENT, SEED, range(BATCH))
    formats: dict[str, Callable[[int], Cost]] = {
        "one file per run": lambda n_runs: measure_study(histories, n_runs, 1),
        "batches": lambda n_runs: measure_study(histories, n_runs, BATCH),
        "Zarr, sharded": lambda n_runs: measure_zarr(histories, n_runs),
    }
    rows = []
    for n_runs in parser.parse_args().runs:
        for name, measure in formats.items():
            if n_runs > MAX_RUNS[name]:
                continue
            cost = measure(n_runs)
            times = [f"{value:.3f}" for value in cost[:4]]
            print(n_runs, name, *cost, flush=True)
            counts = [f"{value:,.0f}" for value in cost[4:]]
            rows.append([f"{n_runs:,}", name, *times, *counts])
    header = ["runs", "format", "write, wall", "write", "resume", "open", "bytes", "files", "MiB"]
    print("CPU times in milliseconds per run, except the first; bytes per run.\n")
    print(table(header, rows))


if __name__ == "__main__":
    main()
