"""Conditions that evolve and learn, and their no-learning controls."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.registry import key_of


def evolves_and_learns(experiment: BaseExperiment, innate: xr.Dataset | None) -> bool:
    """Return whether a condition evolves and learns.

    Other models may not be loaded. Then the assay shows whether the condition learns.
    """
    if experiment.evolution.inheritance == "none":
        return False
    if isinstance(experiment, Experiment):
        return experiment.learns
    return innate is not None and bool(innate["energy"].sel(life="on").notnull().any())


def find_control(name: str, experiments: Mapping[str, Experiment]) -> str:
    """Return the condition that differs only in having no learning, or ""."""
    experiment = experiments[name]
    is_control = _is_without_rule if isinstance(experiment, Experiment) else _is_without_learning
    for candidate, other in experiments.items():
        if candidate != name and is_control(experiment, other):
            return candidate
    return ""


def _is_without_rule(experiment: Experiment, other: Experiment) -> bool:
    """Return whether a MiniWorld condition is `experiment` with another, inactive rule."""
    if other.learns:
        return False
    tree = experiment.to_dict()
    shared = {"name": experiment.name, "learning": tree["learning"]}
    return bool(other.to_dict() | shared == tree)


def _is_without_learning(experiment: BaseExperiment, other: BaseExperiment) -> bool:
    """Return whether `other` is `experiment` without learning, for any other model."""
    try:
        return bool(
            experiment.without_learning().to_dict() | {"name": other.name} == other.to_dict()
        )
    # The model is not loaded.
    except ExperimentError:
        key = key_of(experiment.model)
        tree = experiment.to_dict()
        other_tree = other.to_dict()
        shared = {"name": experiment.name, key: tree[key]}
        return other_tree | shared == tree and _switches_learning_off(other_tree[key], tree[key])


def _switches_learning_off(other: Mapping[str, object], settings: Mapping[str, object]) -> bool:
    """Return whether a single setting of a model differs, and it is off in `other`."""
    differing = [name for name in settings if other.get(name) != settings[name]]
    return len(differing) == 1 and other.get(differing[0]) is False
