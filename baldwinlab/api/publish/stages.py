"""Results for the report of a study in stages: the confirmation and the specification curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.report.content import count_runs, format_range
from baldwinlab.analysis.report.setup import format_value
from baldwinlab.analysis.stages.analysis import (
    SpecificationResults,
    compare_with_noise,
    evaluate_specifications,
)
from baldwinlab.analysis.stages.section import StagedResults
from baldwinlab.analysis.statistics.fitness import get_unseen_maps
from baldwinlab.core.deferred import xr
from baldwinlab.core.files import is_study, read_json
from baldwinlab.experiment.fields import to_plain_data
from baldwinlab.experiment.paths import look_up
from baldwinlab.papers import Paper
from baldwinlab.papers.design import FROZEN_FILE, SPECIFICATIONS_FOLDER, Design, digest_files
from baldwinlab.studies.assays.results import read_assays
from baldwinlab.studies.assays.unseen_maps import UNSEEN_MAPS
from baldwinlab.studies.store import StudyStore


def read_staged_results(
    study: StudyStore,
    paper: Paper,
    design: Design,
    data: xr.Dataset,
    results: Sequence[ClaimResult],
) -> StagedResults | None:
    """Return the results of a study in stages, or None without `unseen-maps` of a learner."""
    unseen = get_unseen_maps(data)
    values = {
        name: unseen.sel(condition=name).dropna("run").values
        for name in study.experiments
        if unseen.sel(condition=name).notnull().any()
    }
    tuned = _format_tuned_settings(study, design)
    rows = compare_with_noise(values, study.factors, design.noise_controls, tuned, results)
    if not rows:
        return None
    digests = _read_digests(study)
    curve, settings = _read_specifications(study, design)
    return StagedResults(
        rows=rows,
        noise_controls=design.noise_controls,
        specifications=curve,
        settings={
            field: " or ".join(format_value(value) for value in values_of_field)
            for field, values_of_field in design.specification_curve.factors.items()
        },
        ranks_by_setting=curve.rank_by_setting(settings) if curve else [],
        digests=digests,
        notes=[*describe_size(study, paper, data), *_describe_changed_files(paper, digests)],
    )


def describe_size(study: StudyStore, paper: Paper, data: xr.Dataset) -> list[str]:
    """Return sentences if a study is smaller than the study of the paper, or exploratory."""
    metadata = paper.metadata
    if study.first_run != metadata.first_run:
        return [
            f"The runs of this study start at number {study.first_run}, and the confirmation of "
            f"the paper starts at {metadata.first_run}: this is an exploratory study, for example "
            "of an earlier edition, and the claims do not apply to it."
        ]
    maps = {factors.map for factors in study.factors.values()}
    n_maps = max(1, len(metadata.maps))
    runs = count_runs(data).values()
    if len(maps) == n_maps and min(runs) >= metadata.runs:
        return []
    return [
        f"This is a quick or incomplete study: {format_range(runs)} of {metadata.runs} runs and "
        f"{len(maps)} of {n_maps} maps. It checks the procedure, and its verdicts are preliminary."
    ]


def _read_digests(study: StudyStore) -> dict[str, str]:
    """Return the SHA-256 of the claims and of the tuned values at the start of the study."""
    path = study.directory / FROZEN_FILE
    return dict(read_json(path)) if path.exists() else {}


def _describe_changed_files(paper: Paper, digests: Mapping[str, str]) -> list[str]:
    """Return a sentence for each file of the paper that differs from the start of the study."""
    # `tuned` replaces a missing file. Only files that exist are compared below.
    current = digest_files(paper, tuned="")
    return [
        f"{name} has been changed since the study was created: its claims were not fixed before."
        for name, digest in digests.items()
        if (paper.folder / name).exists() and current[name] != digest
    ]


def _format_tuned_settings(study: StudyStore, design: Design) -> dict[str, str]:
    """Return the tuned setting of each condition, such as "rate 0.03"."""
    settings = {}
    for grid in design.tuning.grids:
        targets = (grid.target,) if grid.target else grid.conditions
        name = grid.field.rpartition(".")[2]
        for condition, experiment in study.experiments.items():
            if study.factors[condition].learner in targets:
                value, _ = look_up(experiment, grid.field)
                settings[condition] = f"{name} {format_value(value)}"
    return settings


def _read_specifications(
    study: StudyStore, design: Design
) -> tuple[SpecificationResults | None, dict[str, dict[str, str]]]:
    """Return the specification curve from the folder next to the study, or None.

    The second result has the values of the factors of the design by specification.
    """
    directory = study.directory.parent / SPECIFICATIONS_FOLDER
    if not is_study(directory):
        return None, {}
    specifications = StudyStore(directory)
    assays: Mapping[str, xr.Dataset] = read_assays(specifications, [UNSEEN_MAPS]).get(
        UNSEEN_MAPS, {}
    )
    values = {name: np.asarray(data["energy"].mean("map")) for name, data in assays.items()}
    # A study of an earlier design has other values than this design.
    settings = {
        specifications.factors[name].variant: {
            field: format_value(to_plain_data(look_up(experiment, field)[0]))
            for field in design.specification_curve.factors
        }
        for name, experiment in specifications.experiments.items()
    }
    curve = evaluate_specifications(values, specifications.factors, design.noise_controls)
    return curve, settings
