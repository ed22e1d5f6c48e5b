"""Load experiments: `bl.load` by name or file, `bl.read_experiment` from a dataset."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.suggestions import list_names
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.toml import from_toml
from baldwinlab.papers import presets
from baldwinlab.papers.paper import STANDARD_VARIANT

if TYPE_CHECKING:
    import xarray as xr

SOURCE_NAME = "the dataset's experiment"
"""The source of an experiment in error messages."""


@cache
def load_installed_parts() -> None:
    """Register the parts of the entry point group `baldwinlab.parts`, once."""
    if entry_points(group="baldwinlab.parts"):
        # Imported late: loading the engine takes a while.
        from baldwinlab.parts import load_entry_points

        load_entry_points()


def load(experiment: str | Path, variant: str = STANDARD_VARIANT) -> Experiment:
    """Return an experiment by its name or from a file.

    Parameters
    ----------
    experiment
        A preset, such as "evo+self-taught/B" or "PAPER:NAME"; the name of a custom model; or a file
        that ends in .toml.
    variant
        Name of a variant of the paper's model, whose settings are applied last.

    Returns
    -------
    Experiment
        The settings of the experiment.

    Raises
    ------
    ExperimentError
        The preset, the file or the variant does not exist, or the file is not valid.
    PaperError
        The paper does not exist or is not valid.
    PartError
        A part of an installed package cannot be loaded.
    """
    load_installed_parts()
    return presets.load(experiment, variant)


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
    load_installed_parts()
    if "experiment" in dataset.attrs:
        return from_toml(dataset.attrs["experiment"], source=SOURCE_NAME, lenient=True)
    if "experiment" not in dataset:
        raise RefusedError(
            "the dataset has no attribute or variable 'experiment'; give a dataset that baldwinlab "
            "returned, not a dataset that was computed from it"
        )
    texts = dataset["experiment"]
    if condition is not None and "condition" in texts.coords:
        has_condition = condition in texts.condition.values
        # Without the condition, no text remains, and the error below lists the conditions.
        texts = texts.sel(condition=condition) if has_condition else texts.isel(condition=[])
    if texts.size != 1:
        raise RefusedError(
            f"condition = {condition!r} does not select one experiment of the dataset; "
            f"{_describe_choice(dataset, condition)}"
        )
    return from_toml(str(texts.item()), source=SOURCE_NAME, lenient=True)


def _describe_choice(dataset: xr.Dataset, condition: str | None) -> str:
    """Return the choices as text: the names of the conditions, or a point of a sweep."""
    if "condition" not in dataset.coords:
        return "select one point of it"
    names = [str(name) for name in dataset.condition.values.ravel()]
    return list_names(str(condition), names) if names else "select one point of it"
