"""Settings that would do nothing: refused where a user gives them, so that nobody compares two names for the same thing.

Only what is given is refused, never what is stored, nor what a sweep or an assay makes of it: with the learner switched off,
all that is set of learning is idle on purpose.
"""

from __future__ import annotations

from collections.abc import Sequence

from baldwinlab.experiment import Evolution, Experiment, ExperimentError, Learning


def idle_settings(experiment: Experiment) -> list[str]:
    """The paths of the fields that are set otherwise than by default, and change nothing: ["learning.teacher"]."""
    learning, evolution = experiment.learning, experiment.evolution
    found = []
    if not experiment.learns:
        fields = ("teacher", "evolved_rate", "cost_per_step", "cost_per_change")
        found += [f"learning.{name}" for name in fields if getattr(learning, name) != Learning.model_fields[name].default]
    elif evolution.inheritance == "none" and learning.teacher != Learning.model_fields["teacher"].default:
        found.append("learning.teacher")
    inherits_what_is_learned = experiment.learns and evolution.inheritance != "none"
    if not inherits_what_is_learned and evolution.lamarckian_share != Evolution.model_fields["lamarckian_share"].default:
        found.append("evolution.lamarckian_share")
    return found


def require_effect(experiments: Sequence[Experiment]) -> None:
    """Raises ExperimentError, with a line for every setting that does nothing in any of the experiments given together."""
    paths = sorted(set.intersection(*(set(idle_settings(experiment)) for experiment in experiments)))
    rule, inheritance = experiments[0].learning.rule, experiments[0].evolution.inheritance
    where = f'learning.rule = "{rule}"' if rule == "none" else f'evolution.inheritance = "{inheritance}"'
    if paths:
        raise ExperimentError("\n".join(f"{path}: does nothing with {where}; leave it out, or change that" for path in paths))
