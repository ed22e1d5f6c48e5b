"""The command `show`: an experiment as TOML."""

from __future__ import annotations

import sys

from baldwinlab.cli.options import Assignments, Experiment, Parts, Variant, load_parts
from baldwinlab.experiment import assign
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers import presets


def show(
    experiment: Experiment,
    /,
    *,
    part: Parts = None,
    variant: Variant = "standard",
    assignments: Assignments = None,
) -> None:
    """Print an experiment as TOML, with the meaning and unit of each setting.

    Save the output in a file, edit it, and run the file.

    For example:

        baldwinlab show evo+self-taught/B --set lifetime.steps=1000 > short.toml
        baldwinlab run short.toml
    """
    load_parts(part)
    loaded = presets.load(experiment, variant)
    shown = assign(loaded, assignments or [])
    is_unchanged_preset_name = shown.name == loaded.name and not presets.is_file(experiment)
    sys.stdout.write("# " * is_unchanged_preset_name + to_toml(shown))
