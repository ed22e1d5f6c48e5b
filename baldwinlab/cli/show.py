"""The command `show`: print an experiment as TOML."""

from __future__ import annotations

from baldwinlab.cli.options import Assignments, Experiment, Json, Parts, Variant, load_parts
from baldwinlab.core import console
from baldwinlab.experiment import assign
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers import presets
from baldwinlab.papers.paper import STANDARD_VARIANT


def show(
    experiment: Experiment,
    /,
    *,
    part: Parts = None,
    variant: Variant = STANDARD_VARIANT,
    assignments: Assignments = None,
    json: Json = False,
) -> None:
    """Print an experiment as TOML, with the meaning and unit of each setting.

    Save the output in a file, edit it, and run the file.

    For example:

        baldwinlab show evo+self-taught/B --set lifetime.steps=1000 > short.toml
        baldwinlab run short.toml
    """
    load_parts(part)
    original = presets.load(experiment, variant)
    changed = assign(original, assignments or [])
    if json:
        console.print_json(changed.to_dict())
        return
    toml = to_toml(changed)
    has_name_of_preset = changed.name == original.name and not presets.is_file(experiment)
    if has_name_of_preset:
        # The first line is the name. It becomes a comment, because a user edits the file, and the
        # edited experiment must not have the name of the preset.
        toml = f"# {toml}"
    console.write_output(toml)
