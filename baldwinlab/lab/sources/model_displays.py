"""The displays of an experiment in the World tab: alleles, views, and how to draw its species."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from baldwinlab.analysis.palette import choose_species_style
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.species import combine_inputs
from baldwinlab.parts import View


def read_alleles(experiment: BaseExperiment) -> Mapping[str, float]:
    """Return the value of each allele of the model by name; {} if the model is not loaded."""
    model = experiment.loaded_model
    return model.alleles if model else {}


def read_views(experiment: BaseExperiment) -> Mapping[str, View]:
    """Return each view of the model by name; {} if the model is not loaded."""
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


def describe_species(experiment: BaseExperiment) -> dict[str, Any]:
    """Return {"species": [ENTRY, ...]} for the header of a container; {} without species.

    An entry has `name`, `color` and `shape`. In a model with a world, an entry also has `actions`,
    and `inputs`: the index of each input of the species in `appearance.inputs` of the world.
    """
    if not experiment.population.species:
        return {}
    entries: list[dict[str, Any]] = []
    for number, species in enumerate(experiment.population.species):
        color, shape = choose_species_style(number)
        entries.append({"name": species.name, "color": color, "shape": shape})
    if isinstance(experiment, Experiment):
        members = experiment.species_experiments()
        _, inputs_of_species = combine_inputs([member.inputs for member in members])
        for entry, member, inputs in zip(entries, members, inputs_of_species, strict=True):
            entry |= {"inputs": inputs, "actions": list(member.actions)}
    return {"species": entries}
