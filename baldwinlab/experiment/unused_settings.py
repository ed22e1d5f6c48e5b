"""Unused settings, which have no effect in an experiment. Changing such a setting is an error.

A user has changed a setting if its value differs from the origin of the experiment: the preset,
the base of the file, or the defaults. Stored studies and experiments of assays may contain unused
settings, for example settings of learning in an experiment without learning.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from baldwinlab.experiment.base import BaseExperiment, validate
from baldwinlab.experiment.fields import ExperimentError
from baldwinlab.experiment.miniworld import Experiment
from baldwinlab.experiment.paths import look_up
from baldwinlab.experiment.species import ACROSS

PREY: Final = "eats.prey"
SPECIES_SETTINGS: Final = ("evolution.compete", PREY)
"""Settings that only experiments with species use."""
STOP: Final = "evolution.stop"
FIXATION: Final = "fixation"
"""Value of `evolution.stop` that needs competing species."""


def list_unused_settings(experiment: BaseExperiment) -> dict[str, str]:
    """Return the unused settings of an experiment by path, each with the reason."""
    if members := experiment.species_experiments():
        # A setting is unused only if no species uses the setting.
        first_reasons, *other_reasons = [list_unused_settings(member) for member in members]
        unused = {}
        for path, reason in first_reasons.items():
            is_unused_in_all = all(path in reasons for reasons in other_reasons)
            if is_unused_in_all and path not in (*SPECIES_SETTINGS, STOP):
                unused[path] = reason
        return unused | _unused_stop(experiment)
    no_species = dict.fromkeys(SPECIES_SETTINGS, "population.species = []")
    if not isinstance(experiment, Experiment):
        del no_species[PREY]
    return (
        no_species
        | _unused_stop(experiment)
        | _unused_mutation_settings(experiment)
        | (_unused_miniworld_settings(experiment) if isinstance(experiment, Experiment) else {})
    )


def _unused_stop(experiment: BaseExperiment) -> dict[str, str]:
    """Return `evolution.stop` with the reason if it stops at a fixation, which cannot occur."""
    if experiment.evolution.stop != FIXATION:
        return {}
    if not experiment.population.species:
        return {STOP: "population.species = []"}
    compete = experiment.evolution.compete
    return {} if compete == ACROSS else {STOP: f'evolution.compete = "{compete}"'}


def list_changed_unused_settings(
    experiment: BaseExperiment, origin: BaseExperiment | None = None
) -> dict[str, str]:
    """Return the unused settings with other values than the origin, each with the reason.

    Without an origin, the values are compared with the defaults.
    """
    origin = validate({"model": experiment.model}) if origin is None else origin
    return {
        path: reason
        for path, reason in list_unused_settings(experiment).items()
        if look_up(experiment, path)[0] != look_up(origin, path)[0]
    }


def _unused_mutation_settings(experiment: BaseExperiment) -> dict[str, str]:
    name = experiment.evolution.variation
    part = experiment.part("evolution.variation")
    fields = [
        field for field in type(experiment.evolution).model_fields if field.startswith("mutation_")
    ]
    return {
        f"evolution.{field}": f'evolution.variation = "{name}"'
        for field in fields
        if field not in part.reads
    }


def _unused_miniworld_settings(experiment: Experiment) -> dict[str, str]:
    reasons: dict[str, str] = {}
    rule = f'learning.rule = "{experiment.learning.rule}"'
    if not experiment.learns:
        fields = ("control", "rate", "steps", "evolved_rate", "cost_per_step", "cost_per_change")
        paths = (*(f"learning.{field}" for field in fields), "evolution.lamarckian_share")
        reasons |= dict.fromkeys(paths, rule)
    if "reinforcement" not in experiment.modules:
        reasons["learning.teacher"] = rule
    if experiment.evolution.inheritance == "none":
        reasons |= dict.fromkeys(
            ("learning.teacher", "evolution.lamarckian_share", "evolution.elite"),
            'evolution.inheritance = "none"',
        )
    return reasons


def require_effect(
    experiments: Sequence[BaseExperiment], origins: Sequence[BaseExperiment | None] = ()
) -> None:
    """Raise ExperimentError for changed settings that are unused in all given experiments.

    `origins`: origin of each experiment. None, or an empty sequence, stands for the defaults.
    """
    origins = origins or [None] * len(experiments)
    pairs = zip(experiments, origins, strict=True)
    unused = [list_changed_unused_settings(experiment, origin) for experiment, origin in pairs]
    paths = [path for path in unused[0] if all(path in reasons for reasons in unused)]
    if paths:
        raise ExperimentError(
            "\n".join(describe_unused_setting(path, unused[0][path]) for path in paths)
        )


def describe_unused_setting(path: str, reason: str) -> str:
    """Return the sentence about an unused setting. `reason`: such as `learning.rule = "none"`."""
    choice = reason.partition(" = ")[0]
    return f"{path}: does nothing with {reason}; leave it out, or change {choice}"
