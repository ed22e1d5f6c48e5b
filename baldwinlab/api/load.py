"""Load experiments by name: `bl.load`. Parts of installed packages are registered first."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

from baldwinlab.experiment import Experiment
from baldwinlab.papers import presets
from baldwinlab.papers.paper import STANDARD


@cache
def load_installed() -> None:
    """Register the parts of the entry point group `baldwinlab.parts`, once.

    Raises
    ------
    PartError
        A part cannot be loaded.
    """
    if entry_points(group="baldwinlab.parts"):
        # Imported late: loading the engine takes a while.
        from baldwinlab.parts import load_entry_points

        load_entry_points()


def load(experiment: str | Path, variant: str = STANDARD) -> Experiment:
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
    load_installed()
    return presets.load(experiment, variant)
