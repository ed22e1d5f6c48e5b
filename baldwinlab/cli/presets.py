"""What can be run."""

from __future__ import annotations

import sys

from baldwinlab import console, presets
from baldwinlab.cli.common import Assignments, Parts, load_parts
from baldwinlab.experiment import assign
from baldwinlab.experiment.toml import to_toml


def list_presets() -> None:
    """List the presets: conditions, controls, maps and readings."""
    for kind in presets.KINDS:
        console.say(kind)
        for name in presets.names(kind):
            console.say(f"  {name:<22} {presets.describe(kind, name)}")
    console.say("an experiment is CONDITION/MAP, such as evo+self-taught/B; a reading is chosen by --reading")


def show(experiment: str, /, *, part: Parts = None, assignments: Assignments = None) -> None:
    """Show an experiment as TOML, which can be edited and run."""
    load_parts(part)
    sys.stdout.write(to_toml(assign(presets.load(experiment), assignments or [])))
