"""Cells of a study of many experiments: simulate the missing cells, and store the values of each.

A cell has one task, and one netCDF file. The attributes of the file identify the settings of the
cell, so that a repeated command simulates only cells that are missing, damaged or changed.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from baldwinlab._version import __version__
from baldwinlab.api.run_options import AssayOptions
from baldwinlab.api.run_study import report_progress_on_error
from baldwinlab.core import console
from baldwinlab.core.deferred import xr
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import ASSAY_FILE, read_bytes, read_json
from baldwinlab.core.netcdf import DamagedError, from_bytes, to_bytes, verify_checksum
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.papers.design import FROZEN_FILE
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.studies.executors import Task, describe_workers
from baldwinlab.studies.records import write_in_study
from baldwinlab.studies.store import StudyStore

CELL_FOLDER = "cells"
Identity = Mapping[str, str]
"""Attributes of a file that identify the settings of its cell."""


@dataclass(frozen=True)
class CellsRequest:
    """A study of cells to run: the atlas, or what-guides."""

    directory: Path
    seed: int = 0
    runs: int | None = None  # Number of runs of each cell. None: as in the design.
    is_quick: bool = False  # Whether to run the short form, without verdicts.


class StoredTask(Task, Protocol):
    """Task that returns the values of all runs of a cell as a dataset."""

    @property
    def name(self) -> str:
        """Name of the cell."""

    def identify(self, seed: int) -> Identity:
        """Return the attributes that identify the settings of the cell."""


def split_runs(runs: Sequence[int], n_agents: int, limit: int) -> Iterator[Sequence[int]]:
    """Yield groups of runs with at most `limit` agents. `n_agents`: number of agents of a run."""
    size = max(1, limit // n_agents)
    for first in range(0, len(runs), size):
        yield runs[first : first + size]


def cell_path(directory: Path, cell: str) -> Path:
    """Return the file of the values of a cell."""
    return directory / CELL_FOLDER / f"{cell}.nc"


def read_cell(path: Path, identity: Identity, runs: Sequence[int]) -> xr.Dataset | None:
    """Return the values of a cell, or None if missing, damaged, or of other settings or runs."""
    try:
        raw = read_bytes(path, ASSAY_FILE)
        verify_checksum(raw)
        data = from_bytes(raw)
    except FileNotFoundError:
        return None
    except (DamagedError, ValueError, OSError) as error:
        console.warn(f"{path} cannot be read: {error}; the cell is simulated again")
        return None
    is_same = all(data.attrs.get(name) == value for name, value in identity.items())
    return data if is_same and data["run"].values.tolist() == [*runs] else None


def simulate_cells(
    study: StudyStore, tasks: Sequence[StoredTask], n_cells: int, options: AssayOptions
) -> None:
    """Simulate the missing cells of a study, and store their values."""
    executor = options.make_executor()
    console.info_once(describe_workers(executor, executor.workers, len(tasks)))
    compile_experiments(
        (experiment for task in tasks for experiment in task.experiments), log=console.info
    )
    n_missing = len(tasks)

    def store(task: StoredTask, values: xr.Dataset) -> None:
        nonlocal n_missing
        labeled = values.assign_attrs(task.identify(study.seed), baldwinlab=__version__)
        write_in_study(study.directory, cell_path(study.directory, task.name), to_bytes(labeled))
        n_missing -= 1

    def describe_stored() -> str:
        return f"{n_cells - n_missing} of {n_cells} cells are stored in {study.directory}"

    with (
        report_progress_on_error(study.directory, describe_stored),
        console.progress("simulating", sum(task.agent_steps for task in tasks)) as show_progress,
        closing(executor.run(study, tasks, executor.workers, CPU, store)) as increments,
    ):
        for agent_steps in increments:
            show_progress(agent_steps)


def freeze_design(directory: Path, digests: Mapping[str, str]) -> None:
    """Store the SHA-256 of the files of a design at the first start."""
    path = directory / FROZEN_FILE
    if not path.exists():
        write_atomically(path, json.dumps(dict(digests), indent=2).encode())


def read_digests(directory: Path) -> dict[str, str]:
    """Return the SHA-256 by file of the design at the first start."""
    digests: dict[str, str] = read_json(directory / FROZEN_FILE)
    return digests
