"""Load experiments, and parts of installed packages: `bl.load`."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.names import list_names
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


def load(source: str | Path | xr.Dataset, variant: str = STANDARD_VARIANT) -> Experiment:
    """Return an experiment by its name, from a file, or from a dataset of its results.

    Parameters
    ----------
    source : str, pathlib.Path or xarray.Dataset
        A preset, such as "evo+self-taught/B" or "PAPER:NAME"; the name of a custom model; a file
        that ends in .toml; or a run, a replay, an assay or the data of a study. If a dataset has
        several conditions, select one: `data.sel(condition="evo/A")`.
    variant : str
        Name of a variant of the paper's model. The settings of the variant are applied last.

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
    RefusedError
        The dataset has no experiment, or several.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> experiment = bl.load("evo+self-taught/B")
    >>> experiment.learning.rule, experiment.population.size
    ('self-taught', 20)
    >>> bl.load("hinton-nowlan-1987:guessing").model
    'hinton-nowlan'
    """
    load_installed_parts()
    if isinstance(source, str | Path):
        return presets.load(source, variant)
    if variant != STANDARD_VARIANT:
        raise RefusedError(f"variant = {variant!r} applies to a preset or a file, not to a dataset")
    return _read_experiment(source)


def _read_experiment(dataset: xr.Dataset) -> Experiment:
    """Return the experiment that produced a dataset."""
    if "experiment" in dataset.attrs:
        return from_toml(dataset.attrs["experiment"], source=SOURCE_NAME, lenient=True)
    if "experiment" not in dataset:
        raise RefusedError(
            "the dataset has no attribute or variable 'experiment'; give a dataset that baldwinlab "
            "returned, not a dataset that was computed from it"
        )
    texts = dataset["experiment"]
    if texts.size != 1:
        choice = "select one point of it"
        if "condition" in dataset.coords:
            names = [str(name) for name in dataset.condition.values.ravel()]
            choice = f"select one of them with data.sel(condition=...); {list_names('', names)}"
        raise RefusedError(f"the dataset has {texts.size} experiments; {choice}")
    return from_toml(str(texts.item()), source=SOURCE_NAME, lenient=True)
