"""What can be run."""

from __future__ import annotations

import sys

from baldwinlab import papers
from baldwinlab.cli.options import Assignments, NamedExperiment, Parts, Variant, load_parts
from baldwinlab.core import console
from baldwinlab.experiment import assign
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers import presets


def list_presets() -> None:
    """List the presets of each paper: conditions, controls, maps and variants."""
    for paper in papers.built_in().values():
        console.info(f"{paper.name}: {paper.about.title}")
        for kind in presets.KINDS:
            names = paper.names(kind)
            if names:
                console.info(f"  {kind}")
            for name in names:
                console.info(f"    {name:<22} {paper.describe(kind, name)}")
    console.info(
        "an experiment is CONDITION/MAP, such as evo+self-taught/B; a variant is chosen by --variant"
    )


def show(
    experiment: NamedExperiment,
    /,
    *,
    part: Parts = None,
    variant: Variant = "standard",
    assignments: Assignments = None,
) -> None:
    """Show an experiment as TOML, which can be edited and run."""
    load_parts(part)
    loaded = presets.load(experiment, variant)
    shown = assign(loaded, assignments or [])
    is_unchanged_preset_name = shown.name == loaded.name and not presets.is_file(experiment)
    sys.stdout.write("# " * is_unchanged_preset_name + to_toml(shown))
