"""Open the stored runs of a study as one dataset; this loads no engine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from baldwinlab.core.files import location
from baldwinlab.core.variables import DIMENSIONS, PARENTS, RUN
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import coordinates
from baldwinlab.experiment.toml import to_toml
from baldwinlab.studies.store import StudyStore


def open_runs(directory: str | Path, conditions: Sequence[str] | None = None) -> xr.Dataset:
    """All stored runs of a study, without the genomes, as one dataset with dims (condition, run, generation, agent).

    `conditions` picks some of the study's. Where they have different numbers of runs, generations or agents, the gaps are NaN.
    `experiment(condition)` is each condition as TOML; `learner`, `map` and `variant` are coordinates along `condition`, as far as
    the conditions have them ("" where one has not). Write `data["map"]`: `data.map` is a method of xarray. Units and meanings are
    attributes, `units` and `long_name`.

    Raises StudyError for a condition that the study has not, and (as DamagedRecordError) for a record that is not what was
    written.
    """
    study = StudyStore(location(directory))
    return open_conditions(study, list(study.experiments if conditions is None else conditions))


def open_conditions(study: StudyStore, names: Sequence[str]) -> xr.Dataset:
    """As `open_runs`, of a study that is open already: of thousands of conditions, opening it takes seconds."""
    return together(study, names, [_open_condition(study, name) for name in names])


def together(study: StudyStore, names: Sequence[str], opened: Sequence[xr.Dataset]) -> xr.Dataset:
    """What was opened of each of these conditions, (run, generation, agent), as one dataset with what the study says of them."""
    texts = [to_toml(study.experiment(name)) for name in names]
    found = xr.concat(
        opened, "condition", join="outer", data_vars="all", coords="minimal", combine_attrs="drop"
    )
    found = found.assign_coords(condition=list(names)).assign_coords(
        coordinates([study.factors[name] for name in names])
    )
    for name in (
        found.data_vars
    ):  # a gain may be another in each model, and then has no one unit and meaning
        told = [one[name].attrs for one in opened if name in one and one[name].attrs]
        found[name].attrs = told[0] if told and all(each == told[0] for each in told) else {}
    for name, meaning in DIMENSIONS.items():
        found[name].attrs = {"long_name": meaning}
    found = (
        found.drop_encoding()
    )  # which says how records are stored: written so, gaps among whole numbers would be lost
    return found.assign(experiment=("condition", texts)).assign_attrs(seed=study.seed)


def _open_condition(study: StudyStore, condition: str) -> xr.Dataset:
    numbers = study.runs(condition)
    if not numbers:
        return no_runs(study.experiments[condition])
    records = [study.read(condition, run, genomes=False) for run in numbers]
    found = xr.concat(records, "run", combine_attrs="drop").assign_coords(
        run=np.array(numbers, np.int32)
    )
    for name, variable in records[0].data_vars.items():
        found[name].attrs = variable.attrs  # its unit and its meaning
    return found


def no_runs(experiment: Experiment) -> xr.Dataset:
    """What is opened of a condition of which no run is stored."""
    sizes = {
        "run": 0,
        "generation": experiment.evolution.generations,
        "agent": experiment.population.size,
        "parent": len(PARENTS),
    }
    names = (
        ("food_eaten", "energy", "parents")
        if isinstance(experiment, Experiment)
        else ("energy", "parents")
    )
    arrays = {name: ("run", *RUN[name].dims) for name in names}
    empty = {
        name: (dims, np.empty([sizes[dim] for dim in dims], RUN[name].dtype))
        for name, dims in arrays.items()
    }
    coords = {
        dim: np.arange(size, dtype=np.int32) for dim, size in sizes.items() if dim != "parent"
    }
    return xr.Dataset(empty, coords | {"parent": list(PARENTS)})
