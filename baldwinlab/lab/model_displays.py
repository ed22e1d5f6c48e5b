"""The displays that a model declares for the World tab: alleles and views."""

from __future__ import annotations

from collections.abc import Mapping

from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts import View


def read_alleles(experiment: BaseExperiment) -> Mapping[str, float]:
    """Return the alleles that the model declares. They are empty if the model is not loaded."""
    model = experiment.loaded_model
    return model.alleles if model else {}


def read_views(experiment: BaseExperiment) -> Mapping[str, View]:
    """Return the views that the model declares. They are empty if the model is not loaded."""
    model = experiment.loaded_model
    return model.views if model else {}


def describe_model(experiment: BaseExperiment) -> str:
    """Return the docstring of a model without a world, on one line."""
    return " ".join((type(experiment.model_part).__doc__ or "").split())


def is_viewable(experiment: BaseExperiment) -> bool:
    """Return whether the World tab can show a condition: a world, alleles, or views."""
    return isinstance(experiment, Experiment) or bool(
        read_alleles(experiment) or read_views(experiment)
    )
