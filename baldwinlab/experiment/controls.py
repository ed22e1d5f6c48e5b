"""No-learning controls: the condition of a study that differs from a learner only in learning."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.registry import table_name


def find_control(name: str, experiments: Mapping[str, BaseExperiment]) -> str:
    """Return the condition that differs only in having no learning, or ""."""
    experiment = experiments[name]
    is_control = _make_control_test(experiment)
    for candidate, control in experiments.items():
        if candidate != name and is_control(control):
            return candidate
    return ""


def _make_control_test(experiment: BaseExperiment) -> Callable[[Any], bool]:
    """Return a function that returns whether another experiment is the control."""
    if isinstance(experiment, Experiment):
        return partial(_is_without_rule, experiment)
    try:
        control = _shared_settings(experiment.without_learning())
    # The model is not loaded.
    except ExperimentError:
        return partial(_is_without_learning, experiment)
    return lambda candidate: _shared_settings(candidate) == control


def _shared_settings(experiment: BaseExperiment) -> dict[str, Any]:
    """Return the settings of an experiment without learning that a learner shares."""
    tree = experiment.to_dict()
    # Without learning, the share of the learned change that is inherited has no effect.
    return tree | {"name": "", "evolution": tree["evolution"] | {"lamarckian_share": 0.0}}


def _is_without_rule(experiment: Experiment, candidate: Experiment) -> bool:
    """Return whether `candidate` is a MiniWorld experiment with an inactive learning rule."""
    if candidate.learns:
        return False
    tree = experiment.to_dict()
    shared = {"name": experiment.name, "learning": tree["learning"]}
    return bool(candidate.to_dict() | shared == tree)


def _is_without_learning(experiment: BaseExperiment, candidate: BaseExperiment) -> bool:
    """Return whether `candidate` is `experiment` without learning. Its model is not loaded."""
    key = table_name(experiment.model)
    tree = experiment.to_dict()
    candidate_tree = candidate.to_dict()
    shared = {"name": experiment.name, key: tree[key]}
    if candidate_tree | shared != tree:
        return False
    return _switches_learning_off(candidate_tree[key], tree[key])


def _switches_learning_off(control: Mapping[str, object], settings: Mapping[str, object]) -> bool:
    """Return whether only one setting of a model differs, and is False in `control`."""
    differing = [name for name in settings if control.get(name) != settings[name]]
    return len(differing) == 1 and control.get(differing[0]) is False
