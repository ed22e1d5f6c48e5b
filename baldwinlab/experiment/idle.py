"""Settings that would do nothing: refused where a user gives them, so that nobody compares two names for the same thing.

Only what is given is refused, never what is stored, nor what a sweep or an assay makes of it: with the learner switched off,
all that is set of learning is idle on purpose.
"""

from __future__ import annotations

from collections.abc import Sequence

from baldwinlab.experiment.base import BaseExperiment, validate
from baldwinlab.experiment.fields import ExperimentError
from baldwinlab.experiment.miniworld import Experiment
from baldwinlab.experiment.paths import look_up


def idle_settings(experiment: BaseExperiment) -> dict[str, str]:
    """The fields that are set otherwise than by default and change nothing, each with why: {"learning.teacher": ...}."""
    found = _of_variation(experiment) | (_of_foragers(experiment) if isinstance(experiment, Experiment) else {})
    standard = validate({"model": experiment.model})
    return {path: why for path, why in found.items() if look_up(experiment, path)[0] != look_up(standard, path)[0]}


def _of_variation(experiment: BaseExperiment) -> dict[str, str]:
    """The fields of mutation that the chosen variation does not heed."""
    name, part = experiment.evolution.variation, experiment.part("evolution.variation")
    fields = [field for field in type(experiment.evolution).model_fields if field.startswith("mutation_")]
    return {f"evolution.{field}": f'evolution.variation = "{name}"' for field in fields if field not in part.settings}


def _of_foragers(experiment: Experiment) -> dict[str, str]:
    found: dict[str, str] = {}
    rule = f'learning.rule = "{experiment.learning.rule}"'
    if not experiment.learns:
        fields = ("learning.evolved_rate", "learning.cost_per_step", "learning.cost_per_change", "evolution.lamarckian_share")
        found |= dict.fromkeys(fields, rule)
    if "reinforcement" not in experiment.modules:
        found["learning.teacher"] = rule
    if experiment.evolution.inheritance == "none":
        found |= dict.fromkeys(
            ("learning.teacher", "evolution.lamarckian_share", "evolution.elite"), 'evolution.inheritance = "none"'
        )
    return found


def require_effect(experiments: Sequence[BaseExperiment]) -> None:
    """Raises ExperimentError, with a line for every setting that does nothing in any of the experiments given together."""
    idle = [idle_settings(experiment) for experiment in experiments]
    paths = [path for path in idle[0] if all(path in others for others in idle)]
    if paths:
        lines = (f"{path}: does nothing with {idle[0][path]}; leave it out, or change that" for path in paths)
        raise ExperimentError("\n".join(lines))
