"""Reproduce a paper in stages: tuning, confirmation and specification curve.

The tuning chooses values of settings, and the confirmation evaluates the claims with these values.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from types import MappingProxyType

import numpy as np
import xarray as xr

from baldwinlab.analysis.statistics import fitness
from baldwinlab.api.report import report
from baldwinlab.api.run_options import RunOptions
from baldwinlab.api.run_study import (
    RemainingTime,
    StudyRequest,
    count_missing_runs,
    require_request,
    run_missing,
    run_missing_assays,
)
from baldwinlab.core import console
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import is_study
from baldwinlab.experiment import assign
from baldwinlab.papers import Paper
from baldwinlab.papers.design import (
    CONFIRMATION_FOLDER,
    FROZEN_FILE,
    SPECIFICATIONS_FOLDER,
    TUNED_FILE,
    TUNING_FOLDER,
    Design,
    StudyConditions,
    TunedSettings,
    TuningGrid,
    confirmation_conditions,
    digest_files,
    format_tuned,
    join_map,
    read_tuned,
    specification_conditions,
    tuning_conditions,
)
from baldwinlab.studies.assays.results import assay_path
from baldwinlab.studies.assays.unseen_maps import N_LIVES, UNSEEN_MAPS
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.run import count_agent_steps
from baldwinlab.studies.store import StudyStore

LAST_GENERATIONS = 10
"""Number of final generations over which a run is averaged."""


@dataclass(frozen=True)
class StagedReproduction:
    """A paper with a design, and the size of its study."""

    paper: Paper
    design: Design  # The design, possibly shortened.
    directory: Path  # Folder of the studies of all stages.
    maps: Sequence[str]  # Maps of the tuning and of the confirmation; ("",) if the paper has none.
    runs: int  # Number of runs of each condition of the confirmation.
    seed: int = 0
    assignments: Sequence[str] = ()  # Settings that change the model of the paper in all stages.
    last: int = 10  # Number of final generations that are averaged in each run.

    def tuning_request(self, grid: TuningGrid, value: float) -> StudyRequest:
        """Return the request for the study of one value of a tuning grid."""
        conditions = tuning_conditions(self.paper, self.design, grid, self.maps, value)
        folder = Path(TUNING_FOLDER) / grid.folder(value)
        return self._make_request(conditions, folder, self.design.tuning.runs)

    def confirmation_request(
        self, tuned: TunedSettings, digests: Mapping[str, str] = MappingProxyType({})
    ) -> StudyRequest:
        """Return the request for the study of the confirmation.

        `digests`: SHA-256 of the claims and of the tuned values. A new study stores them.
        """
        conditions = confirmation_conditions(self.paper, self.design, self.maps, tuned)
        request = self._make_request(conditions, Path(CONFIRMATION_FOLDER), self.runs)
        # A repeated call must not replace the digests of the first call.
        is_new = not is_study(request.directory)
        files = {FROZEN_FILE: json.dumps(dict(digests), indent=2).encode()} if is_new else {}
        # The studies of the other stages evaluate no claims.
        return replace(
            request,
            paper=self.paper,
            changes=self.assignments,
            first_run=self.paper.metadata.first_run,
            extra_files=files,
        )

    def specifications_request(self) -> StudyRequest:
        """Return the request for the study of the specification curve."""
        conditions = specification_conditions(self.paper, self.design)
        runs = self.design.specification_curve.runs
        return self._make_request(conditions, Path(SPECIFICATIONS_FOLDER), runs)

    def _make_request(self, conditions: StudyConditions, folder: Path, runs: int) -> StudyRequest:
        experiments = [
            assign(experiment, self.assignments) for experiment in conditions.experiments
        ]
        return StudyRequest(
            experiments,
            self.directory / folder,
            runs=runs,
            seed=self.seed,
            factors=conditions.factors,
        )


def run_stages(reproduction: StagedReproduction, options: RunOptions) -> StudyStore:
    """Run what is missing in the stages. Return the study of the confirmation, with its report."""
    design = reproduction.design
    grid_values = [(grid, value) for grid in design.tuning.grids for value in grid.values]
    tuning = [reproduction.tuning_request(grid, value) for grid, value in grid_values]
    # The tuned values are not known yet. They do not change the number of agent-steps.
    confirmation = reproduction.confirmation_request({})
    specifications = reproduction.specifications_request()
    # All requests are checked before the first study is written. The plans are made again later.
    for request in (*tuning, confirmation, specifications):
        require_request(request, options)
    clock = RemainingTime(
        [
            *(_count_missing_steps(request, is_assayed=False) for request in tuning),
            _count_missing_steps(confirmation, is_assayed=True),
            _count_missing_steps(specifications, is_assayed=True),
        ]
    )
    stores = []
    for (grid, value), request in zip(grid_values, tuning, strict=True):
        clock.announce(f"Tuning, {grid.field} = {value}")
        stores.append(run_missing(request, options))
    measured = _choose_tuned(grid_values, stores, reproduction)
    tuned, digests = _freeze_tuned(measured, reproduction)
    clock.announce("Confirmation")
    study = _run_assayed(reproduction.confirmation_request(tuned, digests), options)
    clock.announce("Specification curve")
    _run_assayed(specifications, options)
    report(study, last=reproduction.last, force=options.force, paper=reproduction.paper)
    return study


def _run_assayed(request: StudyRequest, options: RunOptions) -> StudyStore:
    """Run the missing runs of a study and its assay `UNSEEN_MAPS`."""
    study = run_missing(request, options)
    run_missing_assays(study, [UNSEEN_MAPS], options)
    return study


def _choose_tuned(
    grid_values: Sequence[tuple[TuningGrid, float]],
    stores: Sequence[StudyStore],
    reproduction: StagedReproduction,
) -> dict[str, dict[str, float]]:
    """Return the best values by condition, such as {"evo/A": {"learning.rate": 0.1}}."""
    console.info("choosing the best value of each condition")
    medians = {
        (grid.name, value): measure_medians(open_conditions(study, list(study.experiments)))
        for (grid, value), study in zip(grid_values, stores, strict=True)
    }
    tuned: dict[str, dict[str, float]] = {}
    for grid in reproduction.design.tuning.grids:
        chosen = choose_values({value: medians[grid.name, value] for value in grid.values})
        for condition, map_name in product(grid.conditions, reproduction.maps):
            # The chosen value can be for another condition of the confirmation.
            target = join_map(grid.target or condition, map_name)
            tuned[target] = {grid.field: chosen[join_map(condition, map_name)]}
    return tuned


def _freeze_tuned(
    measured: dict[str, dict[str, float]], reproduction: StagedReproduction
) -> tuple[TunedSettings, dict[str, str]]:
    """Write the measured values. Return those in the paper, or else these, and SHA-256 by file."""
    paper = reproduction.paper
    comment = f"Best values by the runs 0 to {reproduction.design.tuning.runs - 1} of the tuning."
    path = reproduction.directory / TUNED_FILE
    text = format_tuned(measured, comment)
    write_atomically(path, text.encode())
    digests = digest_files(paper, text)
    committed = read_tuned(paper)
    if committed is None:
        console.info(f"{path}: chosen values, used in the confirmation")
        return measured, digests
    different = [name for name in measured if measured[name] != committed.get(name)]
    console.info(
        f"The confirmation uses the values in {TUNED_FILE} of the paper. "
        f"The tuning runs give another value for {len(different)} of {len(measured)} conditions."
    )
    return committed, digests


def _count_missing_steps(request: StudyRequest, is_assayed: bool) -> int:
    """Return the number of agent-steps of the runs and assays that have no file."""
    steps = 0
    for experiment in request.experiments:
        n_missing = count_missing_runs(request, experiment)
        steps += n_missing * count_agent_steps(experiment)
        if is_assayed:
            path = assay_path(request.directory, UNSEEN_MAPS, experiment.name)
            n_assayed = 0 if path.exists() and not n_missing else request.runs
            steps += n_assayed * experiment.agent_steps * N_LIVES
    return steps


def measure_medians(data: xr.Dataset) -> dict[str, float]:
    """Compute the median over runs of the mean fitness in the last generations, by condition."""
    medians = fitness.final(data, "mean", LAST_GENERATIONS).median("run")
    return {str(name): float(medians.sel(condition=name)) for name in data["condition"].values}


def choose_values(medians: Mapping[float, Mapping[str, float]]) -> dict[str, float]:
    """Choose the value with the largest median of each condition. `medians`: [value][condition]."""
    # Of equal medians, `argmax` selects the smallest value.
    values = sorted(medians)
    conditions = list(medians[values[0]])
    return {
        name: values[int(np.argmax([medians[value][name] for value in values]))]
        for name in conditions
    }
