"""Parts that installed packages bring: made known before an experiment is read, and at no other time."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

from baldwinlab.experiment import Experiment
from baldwinlab.papers import presets
from baldwinlab.papers.paper import STANDARD


@cache
def load_installed() -> None:
    """Make known the parts of the entry point group `baldwinlab.parts`, once. Raises PartError for one that fails."""
    if entry_points(group="baldwinlab.parts"):
        from baldwinlab.parts import (
            load_entry_points,
        )  # here, because to load the engine takes a while

        load_entry_points()


def load(experiment: str | Path, variant: str = STANDARD) -> Experiment:
    """An experiment by the name of a preset (`evo+self-taught/B`) or of a model that is a part, or from a TOML file.

    `variant` lays one of the named variants of the paper over it. Raises ExperimentError when there is no such preset, file
    or variant, or when the file's experiment is not valid.
    """
    load_installed()
    return presets.load(experiment, variant)
