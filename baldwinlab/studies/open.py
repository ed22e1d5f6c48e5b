"""Open the stored runs of a study as one dataset; this loads no engine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from baldwinlab.core.files import parse_location
from baldwinlab.core.variables import DIMENSIONS, PARENTS, RUN
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import coordinates
from baldwinlab.experiment.toml import to_toml
from baldwinlab.studies.store import StudyStore


def open_runs(directory: str | Path, conditions: Sequence[str] | None = None) -> xr.Dataset:
    """Return the stored runs of a study as one dataset, without the genomes.

    Parameters
    ----------
    directory
        The directory of a study, or a URL that fsspec can open.
    conditions
        Names of conditions; all, unless given.

    Returns
    -------
    xarray.Dataset
        The variables of `baldwinlab.core.variables.RUN`, with the dimensions `condition`, `run`,
        `generation` and `agent`. Missing values are NaN where conditions differ in their numbers of
        runs, generations or agents. `experiment` is each condition as TOML. `learner`, `map` and
        `variant` are coordinates of `condition` if a condition has them. Write `data["map"]`:
        `data.map` is a method of xarray. The attributes of a variable are its `units` and
        `long_name`.

    Raises
    ------
    StudyError
        There is no study, or it has no such condition.
    DamagedRecordError
        A stored run is damaged.
    """
    study = StudyStore(parse_location(directory))
    return open_conditions(study, list(study.experiments if conditions is None else conditions))


def open_conditions(study: StudyStore, names: Sequence[str]) -> xr.Dataset:
    """As `open_runs`, of a study that is open already: of thousands of conditions, opening it takes seconds."""
    return concat_conditions(study, names, [_open_condition(study, name) for name in names])


def concat_conditions(
    study: StudyStore, names: Sequence[str], opened: Sequence[xr.Dataset]
) -> xr.Dataset:
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
        return make_empty_dataset(study.experiments[condition])
    records = [study.read(condition, run, genomes=False) for run in numbers]
    found = xr.concat(records, "run", combine_attrs="drop").assign_coords(
        run=np.array(numbers, np.int32)
    )
    for name, variable in records[0].data_vars.items():
        found[name].attrs = variable.attrs  # its unit and its meaning
    return found


def make_empty_dataset(experiment: Experiment) -> xr.Dataset:
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
