"""Run the study what-guides: the missing cells of all groups, in one study.

DIR/cells/*.nc      innate fitness of each cell
DIR/frozen.json     SHA-256 of the design at the first start
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, NamedTuple

from baldwinlab.api.cells import (
    CellsRequest,
    cell_path,
    freeze_design,
    read_cell,
    read_digests,
    simulate_cells,
    split_runs,
)
from baldwinlab.api.guidance.simulation import count_agent_steps, list_arms, measure_runs
from baldwinlab.api.run_options import AssayOptions
from baldwinlab.core import console
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.core.numbers import require_whole_number
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.backends.choice import Backend
from baldwinlab.papers.guidance_design import (
    Cell,
    GuidanceDesign,
    digest_guidance,
    list_cells,
    read_guidance,
)
from baldwinlab.studies.creation import create_study, remove_if_refused

# Number of agents of all runs of a batch. Larger batches save little time, and need more memory.
AGENTS_PER_BATCH: Final = 4000


class GuidanceTask(NamedTuple):
    """Task that simulates the runs of a cell."""

    cell: Cell
    runs: tuple[int, ...]

    @property
    def name(self) -> str:
        """Name of the cell."""
        return self.cell.name

    def identify(self, seed: int) -> dict[str, str]:
        """Return the attributes that identify the values of the cell."""
        measured = self.cell.group.model_dump(
            include={"horizons", "noise", "noise_presets", "starts", "costs", "settings", "has_law"}
        )
        return {
            "experiment": to_toml(self.cell.learner),
            "seed": str(seed),
            "measured": json.dumps({**measured, "evaluations": self.cell.evaluations}),
        }

    @property
    def experiments(self) -> tuple[BaseExperiment, ...]:
        """The experiments of all arms."""
        return tuple(arm.experiment for arm in list_arms(self.cell))

    @property
    def agent_steps(self) -> int:
        """Number of agent-steps of all arms."""
        return len(self.runs) * count_agent_steps(self.cell)

    def run(
        self, seed: int, directory: Path, backend: Backend, report_progress: Callable[[int], None]
    ) -> xr.Dataset:
        """Return the values of all runs, from `measure_runs`."""
        parts = [
            measure_runs(self.cell, seed, runs, report_progress)
            for runs in split_runs(self.runs, self.cell.learner.population.size, AGENTS_PER_BATCH)
        ]
        return xr.concat(parts, "run")


def choose_design(request: CellsRequest) -> GuidanceDesign:
    """Return the design, with its cells and runs changed as requested."""
    design = read_guidance()
    design = design.shorten() if request.is_quick else design
    if request.runs is None:
        return design
    require_whole_number("runs", request.runs)
    if request.runs < 2:
        raise ArgumentError("runs", request.runs, "must be at least 2")
    return design.with_runs(request.runs)


def plan_tasks(design: GuidanceDesign) -> list[GuidanceTask]:
    """Return the tasks of all cells."""
    return [
        GuidanceTask(cell, tuple(range(design.first_run, design.first_run + group.runs)))
        for group in design.groups
        for cell in list_cells(group)
    ]


def run_guidance(request: CellsRequest, options: AssayOptions) -> None:
    """Run the missing cells. A repeated call continues, if the design is the same."""
    require_whole_number("seed", request.seed)
    options.make_executor()  # Refuses an invalid executor before a file is written.
    tasks = plan_tasks(choose_design(request))
    with remove_if_refused(request.directory):
        learners = [task.cell.learner for task in tasks]
        study = create_study(request.directory, learners, request.seed)
        freeze_design(request.directory, digest_guidance())
        require_same_design(request.directory)
        missing = [task for task in tasks if _read(request, task) is None]
        console.info(f"{len(missing)} of {len(tasks)} cells are to be simulated")
        # Long tasks begin first, so that all workers end at about the same time.
        missing.sort(key=lambda task: task.agent_steps, reverse=True)
        if missing:
            simulate_cells(study, missing, len(tasks), options)


def require_same_design(directory: Path) -> None:
    """Raise RefusedError if the design differs from that at the first start of the study."""
    if read_digests(directory) != digest_guidance():
        raise RefusedError(
            f"{directory}: the design has changed since this study began, so its predictions would "
            "not be registered before its runs; choose another --out"
        )


def _read(request: CellsRequest, task: GuidanceTask) -> xr.Dataset | None:
    path = cell_path(request.directory, task.name)
    return read_cell(path, task.identify(request.seed), task.runs)


def read_groups(request: CellsRequest, design: GuidanceDesign) -> Mapping[str, xr.Dataset]:
    """Return the values of all cells (cell, run, arm, start, horizon) of each group, by name."""
    groups: dict[str, list[xr.Dataset]] = {group.name: [] for group in design.groups}
    for task in plan_tasks(design):
        data = _read(request, task)
        if data is None:
            raise RefusedError(
                f"{cell_path(request.directory, task.name)} is missing; "
                "`baldwinlab reproduce what-guides` simulates it"
            )
        labels = {field: ("cell", [value]) for field, value in task.cell.values.items()}
        expanded = data.expand_dims(cell=[task.name])
        groups[task.cell.group.name].append(expanded.assign_coords(labels))
    return {name: xr.concat(cells, "cell", combine_attrs="drop") for name, cells in groups.items()}
