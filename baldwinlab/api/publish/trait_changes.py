"""Make the section of a report on the changes of innate traits, from the stored runs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from baldwinlab.analysis.assays.controls import evolves_and_learns
from baldwinlab.analysis.estimands import trait_changes_section
from baldwinlab.analysis.estimands.trait_changes import (
    TraitChanges,
    find_obstacle,
    measure_changes,
)
from baldwinlab.analysis.report import Section
from baldwinlab.core.deferred import xr
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.store import StudyStore

NO_PAIRS = "No two successive generations of the stored assay innate have values of the trait."


def make_section(study: StudyStore, innate: Mapping[str, xr.Dataset]) -> Section | None:
    """Make the section, and write its figures and its CSV file.

    None if no condition with the assay evolves and learns.
    """
    changes: dict[str, TraitChanges] = {}
    obstacles: dict[str, str] = {}
    for name, data in innate.items():
        experiment = study.experiments[name]
        if not evolves_and_learns(experiment, data):
            continue
        obstacles[name] = find_obstacle(experiment)
        if obstacles[name]:
            continue
        runs = open_sample(study, [name]).sel(condition=name)
        result = measure_changes(runs, data, experiment, _read_genotypes(study, name, data))
        if result.values.sizes["generation"]:
            changes[name] = result
        else:
            obstacles[name] = NO_PAIRS
    obstacles = {name: reason for name, reason in obstacles.items() if reason}
    if not (changes or obstacles):
        return None
    return trait_changes_section.make_section(changes, innate, obstacles, study.directory)


def _read_genotypes(study: StudyStore, condition: str, innate: xr.Dataset) -> xr.DataArray | None:
    """Return the stored genomes of the last generation (run, agent, gene).

    None if genomes are graphs, whose genes have no fixed position, or if they are not stored.
    """
    experiment = study.experiments[condition]
    model = experiment.loaded_model
    has_graphs = (
        experiment.network.kind == "neat"
        if experiment.model == "miniworld"
        else model is None or model.has_graph_genomes
    )
    if has_graphs:
        return None
    last_generation = experiment.evolution.generations - 1
    genomes = []
    for run in innate["run"].values.tolist():
        record = study.record(condition, run)
        if record["kept_generation"].values[-1] != last_generation:
            return None
        stored_genomes = record["kept_genome"].values[-1]
        genomes.append(stored_genomes.reshape(len(stored_genomes), -1))
    return xr.DataArray(
        np.stack(genomes),
        dims=("run", "agent", "gene"),
        coords={"run": innate["run"], "generation": last_generation},
    )
