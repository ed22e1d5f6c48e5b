"""Read the experiment of a dataset: `bl.read_experiment`."""

from __future__ import annotations

import xarray as xr

from baldwinlab.api.load import load_installed
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.suggestions import list_names
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.toml import from_toml

ORIGIN = "the dataset's experiment"


def read_experiment(dataset: xr.Dataset, condition: str | None = None) -> Experiment:
    """Return the experiment that produced a dataset.

    Parameters
    ----------
    dataset
        A run, a replay, an assay, or the runs of a study.
    condition
        Name of a condition. A dataset with one experiment does not need it.

    Returns
    -------
    Experiment
        The settings of the experiment.

    Raises
    ------
    RefusedError
        The dataset has no experiment, or `condition` does not select one of several.
    """
    load_installed()
    if "experiment" in dataset.attrs:
        return from_toml(dataset.attrs["experiment"], where=ORIGIN, lenient=True)
    if "experiment" not in dataset:
        raise RefusedError(
            "the dataset has no attribute or variable 'experiment'; give a dataset that baldwinlab "
            "returned, not one that was computed from it"
        )
    texts = dataset["experiment"]
    if condition is not None and "condition" in texts.coords:
        is_known = condition in texts.condition.values
        texts = texts.sel(condition=condition) if is_known else texts.isel(condition=[])
    if texts.size != 1:
        raise RefusedError(
            f"condition = {condition!r} does not select one experiment of the dataset; "
            f"{_describe_choice(dataset, condition)}"
        )
    return from_toml(str(texts.item()), where=ORIGIN, lenient=True)


def _describe_choice(dataset: xr.Dataset, condition: str | None) -> str:
    """Return what to select: a condition, or a point of a sweep."""
    if "condition" not in dataset.coords:
        return "select one point of it"
    names = [str(name) for name in dataset.condition.values.ravel()]
    return list_names(str(condition), names) if names else "select one point of it"
