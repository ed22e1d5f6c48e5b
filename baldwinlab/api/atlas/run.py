"""Run the atlas: the missing cells of all maps, in one folder.

DIR/MAP/            a study of the map, which is a sweep
DIR/MAP/cells/*.nc  values of each cell
DIR/frozen.json     SHA-256 of the files of the atlas at the first start
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import tomlkit

from baldwinlab.analysis.atlas.outcomes import CellData, reduce_cell
from baldwinlab.api.cells import (
    CellsRequest,
    cell_path,
    freeze_design,
    read_cell,
    simulate_cells,
    split_runs,
)
from baldwinlab.api.run_options import AssayOptions
from baldwinlab.api.run_study import RemainingTime
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.numbers import require_whole_number
from baldwinlab.core.records import select_record
from baldwinlab.core.variables import make_dataset
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import SWEEP
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.backends.choice import Backend
from baldwinlab.papers.atlas_design import AtlasDesign, AtlasMap, Size, digest_atlas, read_atlas
from baldwinlab.simulation.records import make_batch
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.assays import LIFE_KINDS, Sample, assimilation, innate
from baldwinlab.studies.assays.catalog import get_assay
from baldwinlab.studies.assays.fork import BRANCH_GENERATIONS, HISTORIES, POPULATION, REGIMES, Fork
from baldwinlab.studies.creation import create_study, remove_if_refused
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import Sweep, read_sweep
from baldwinlab.studies.sweeps.design import SWEEP_FILE_NAME, expand_sweep, label_points

# Number of intervals between the measured generations.
N_INTERVALS = 20
# Largest number of agents, of all generations, in a group of runs, which limits the memory.
MAX_RECORDED_AGENTS = 4_000_000


class CellTask(NamedTuple):
    """Task that simulates some runs of a cell and returns their values."""

    experiment: Experiment
    runs: tuple[int, ...]

    @property
    def name(self) -> str:
        """Name of the cell."""
        return str(self.experiment.name)

    def identify(self, seed: int) -> dict[str, str]:
        """Return the attributes that identify the values of the cell."""
        return {"experiment": to_toml(self.experiment), "seed": str(seed)}

    @property
    def experiments(self) -> tuple[BaseExperiment, ...]:
        """The experiment and its control."""
        return self.experiment, self.experiment.without_learning()

    @property
    def agent_steps(self) -> int:
        """Number of agent-steps of the runs, of their controls and of the measurements."""
        # The few lifetimes with drift are not counted.
        lives_per_generation = len(LIFE_KINDS) - 1 + len(assimilation.HISTORIES)
        lives = (
            2 * self.experiment.evolution.generations  # With and without learning.
            + lives_per_generation * len(choose_generations(self.experiment))
            + len(HISTORIES) * (len(REGIMES) * (BRANCH_GENERATIONS + 1) + 1)
        )
        return len(self.runs) * self.experiment.agent_steps * lives

    def run(
        self, seed: int, directory: Path, backend: Backend, report_progress: Callable[[int], None]
    ) -> xr.Dataset:
        """Return the values of all runs, from `reduce_cell`."""
        n_left = self.agent_steps

        def report_limited(agent_steps: int) -> None:
            """Report agent-steps, but in total at most `agent_steps`."""
            nonlocal n_left
            n_reported = min(n_left, agent_steps)
            n_left -= n_reported
            report_progress(n_reported)

        # Groups of runs whose records fit into the memory.
        n_agents = self.experiment.population.size * self.experiment.evolution.generations
        groups = split_runs(self.runs, n_agents, MAX_RECORDED_AGENTS)
        parts = [
            measure_runs(self.experiment, seed, runs, directory, report_limited) for runs in groups
        ]
        report_limited(n_left)  # Report the rest, if the simulations had fewer agent-steps.
        return xr.concat(parts, "run", combine_attrs="override")


def choose_generations(experiment: BaseExperiment) -> list[int]:
    """Return the generations that are measured: with equal distances, and the last generation."""
    last = experiment.evolution.generations - 1
    return [*range(0, last, _interval(experiment)), last]


def _interval(experiment: BaseExperiment) -> int:
    """Return the number of generations between two measurements, rounded up."""
    return max(1, -(-(experiment.evolution.generations - 1) // N_INTERVALS))


def measure_runs(
    experiment: Experiment,
    seed: int,
    runs: Sequence[int],
    directory: Path,
    report_progress: Callable[[int], None],
) -> xr.Dataset:
    """Simulate runs with and without learning, and return the values of `reduce_cell`."""
    # `_simulate` adds the records. The assays use no other maps.
    sample = Sample(directory, seed, experiment, tuple(runs), (), (), report_progress)
    learners, learner_data = _simulate(sample)
    controls, control_data = _simulate(replace(sample, experiment=experiment.without_learning()))
    learners = replace(learners, control=controls)
    generations = choose_generations(experiment)
    assayed = _label(
        "innate",
        innate.measure_generations(learners, generations),
        run=list(runs),
        generation=generations,
        life=list(LIFE_KINDS),
        layer=innate.layer_names(experiment),
    )
    distances = _label(
        "assimilation",
        assimilation.measure_distances(learners, generations),
        run=list(runs),
        generation=generations,
        history=list(assimilation.HISTORIES),
    )
    forked = _label(
        "fork",
        Fork(POPULATION).measure(learners),
        run=list(runs),
        generation=generations[-1:],
        history=list(HISTORIES),
        regime=list(REGIMES),
    )
    return reduce_cell(CellData(experiment, learner_data, control_data, assayed, distances, forked))


def _simulate(sample: Sample) -> tuple[Sample, xr.Dataset]:
    """Return the sample with its simulated records, and the records as one dataset."""
    interval = _interval(sample.experiment)
    recorded = sample.experiment.replace(record={"genome_every": interval})
    histories = simulate_histories(
        recorded, sample.seed, sample.runs, after_generation=lambda _: sample.report_generation()
    )
    batch = make_batch(histories).to_dataset()
    records = [select_record(batch, index) for index in range(len(histories))]
    return replace(sample, experiment=recorded, records=records), batch


def _label(assay: str, arrays: Mapping[str, Any], **coordinates: Sequence[Any]) -> xr.Dataset:
    """Return the arrays of an assay as a dataset with labels."""
    data = make_dataset(get_assay(assay).variables, arrays, {})
    return data.assign_coords({name: np.asarray(labels) for name, labels in coordinates.items()})


def choose_size(request: CellsRequest, design: AtlasDesign) -> Size:
    """Return the numbers of all runs and of exploratory runs of a cell."""
    size = design.quick if request.is_quick else design.full
    if request.runs is None:
        return size
    require_whole_number("runs", request.runs)
    if request.runs <= size.exploration_runs:
        allowed = f"must be more than the {size.exploration_runs} exploratory runs"
        raise ArgumentError("runs", request.runs, allowed)
    return size.model_copy(update={"runs": request.runs})


@dataclass(frozen=True)
class PlannedMap:
    """A map of the atlas, with the experiments of its cells."""

    atlas_map: AtlasMap
    sweep: Sweep
    cells: Sequence[Experiment]
    directory: Path
    runs: tuple[int, ...]

    def read_cell(self, cell: Experiment, seed: int) -> xr.Dataset | None:
        """Return the values of a cell, or None if missing, damaged or of other settings."""
        path = cell_path(self.directory, cell.name)
        return read_cell(path, CellTask(cell, self.runs).identify(seed), self.runs)


def run_atlas(request: CellsRequest, options: AssayOptions) -> None:
    """Run the missing cells of all maps. A repeated call continues."""
    require_whole_number("seed", request.seed)
    options.make_executor()  # Refuses an invalid executor before a file is written.
    design = read_atlas()
    maps = list(plan_maps(request, design))
    with remove_if_refused(request.directory):
        studies = [_open_map(planned, request.seed) for planned in maps]
        freeze_design(request.directory, digest_atlas(design))
        missing = [
            [
                CellTask(cell, planned.runs)
                for cell in planned.cells
                if planned.read_cell(cell, request.seed) is None
            ]
            for planned in maps
        ]
        # The unit is cells, because an agent-step takes up to 1000 times as long in some models.
        clock = RemainingTime(list(map(len, missing)), "cells")
        for planned, study, tasks in zip(maps, studies, missing, strict=True):
            clock.announce(planned.atlas_map.title)
            if tasks:
                simulate_cells(study, tasks, len(planned.cells), options)


def plan_maps(request: CellsRequest, design: AtlasDesign) -> Iterator[PlannedMap]:
    """Yield the maps of the design with the experiments of the cells."""
    size = choose_size(request, design)
    for atlas_map in design.maps:
        sweep = read_sweep(atlas_map.sweep_file)
        if request.is_quick:
            quick = {field: list(values) for field, values in atlas_map.quick.items()}
            sweep = sweep.model_copy(update={"fields": {**sweep.fields, **quick}})
        yield PlannedMap(
            atlas_map,
            sweep,
            expand_sweep(sweep, atlas_map.sweep_file),
            request.directory / atlas_map.name,
            tuple(range(size.runs)),
        )


def _open_map(planned: PlannedMap, seed: int) -> StudyStore:
    """Return the study of a map, which is created if necessary, and write the file of the sweep."""
    study = create_study(planned.directory, planned.cells, seed, SWEEP)
    sweep = planned.sweep.model_copy(update={"runs": len(planned.runs), "seed": seed})
    tables = sweep.model_dump(by_alias=True, exclude_defaults=True)
    write_atomically(planned.directory / SWEEP_FILE_NAME, tomlkit.dumps(tables).encode())
    return study


def read_map(planned: PlannedMap, seed: int) -> Mapping[str, xr.Dataset]:
    """Return the values of all cells of a map, by name."""
    cells = {}
    for cell in planned.cells:
        data = planned.read_cell(cell, seed)
        if data is None:
            raise RefusedError(
                f"{cell_path(planned.directory, cell.name)} is missing; `baldwinlab reproduce "
                "atlas` simulates it"
            )
        cells[cell.name] = data
    return cells


def stack_cells(planned: PlannedMap, cells: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Return the cells of a map as one dataset, with a dimension per swept field."""
    stacked = xr.concat(list(cells.values()), "condition", combine_attrs="drop")
    stacked = stacked.assign_coords(condition=list(cells))
    return label_points(StudyStore(planned.directory), stacked)
