"""The species of an experiment, as data for the page: how to draw and name their agents."""

from __future__ import annotations

from typing import Any

from baldwinlab.analysis.palette import choose_species_style
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.species import combine_inputs


def describe_species(experiment: BaseExperiment) -> dict[str, Any]:
    """Return the entry `species` of a header; an empty dict without species.

    Each species has its name, color and shape. In a model with a world, it also has its actions,
    and the indices of its inputs in the appearance of the world.
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
