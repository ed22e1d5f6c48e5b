"""Descriptions of MiniWorld experiments in brief sentences, from their settings and parts."""

from __future__ import annotations

from typing import Any, NamedTuple

from baldwinlab.evolution import has_parent_teachers
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.appearance import Appearance, describe_appearance


class Topic(NamedTuple):
    """A heading and its sentences."""

    title: str
    text: str


def list_topics(experiment: Experiment) -> tuple[Topic, ...]:
    """Return the topics that the lab shows for an experiment under "What is this?"."""
    appearance = describe_appearance(experiment)
    if members := experiment.species_experiments():
        return (
            Topic("The map", _describe_map(experiment, appearance)),
            *(
                Topic(f"Species {species.name}", _describe_species(member))
                for species, member in zip(experiment.population.species, members, strict=True)
            ),
            Topic("What to look for", _describe_observations(experiment)),
        )
    return (
        Topic("The map", _describe_map(experiment, appearance)),
        Topic("Senses", _describe_senses(experiment, appearance)),
        Topic("Network", _describe_network(experiment, appearance)),
        Topic("Learning", _describe_learning(experiment, appearance)),
        Topic("What to look for", _describe_observations(experiment)),
    )


def _describe_species(member: Experiment) -> str:
    """Return the size, the senses and the learning of a species."""
    appearance = describe_appearance(member)
    kinds = {kind.name for kind in appearance.item_kinds}
    items = sorted(kinds) if member.eats.items is None else member.eats.items
    diet = [*items, *(prey.species for prey in member.eats.prey)]
    return _join_sentences(
        f"{member.population.size:,} agents in the first generation.",
        f"They eat {' and '.join(diet)}." if diet else "",
        _describe_senses(member, appearance),
        _describe_learning(member, appearance),
    )


def _describe_map(experiment: Experiment, appearance: Appearance) -> str:
    counts: dict[str, int] = {}
    for kind in appearance.item_kinds:
        counts[kind.name] = counts.get(kind.name, 0) + kind.number
    items = " and ".join(f"{number:,} items of {name}" for name, number in counts.items())
    agents = experiment.agents_per_world
    worlds = experiment.population.worlds
    repeats = experiment.lifetime.repeats
    steps = experiment.lifetime.steps
    return _join_sentences(
        f"{agents:,} agents are born in the dashed circle and live {steps:,} steps.",
        f"A population has {worlds:,} worlds. The first one is shown." if worlds > 1 else "",
        f"An agent has {repeats:,} lifetimes. The first one is shown." if repeats > 1 else "",
        f"The tinted regions contain {items}." if items else "",
        "An eaten item reappears at a random position in its region." if items else "",
        *(_summary_of_part(feature) for feature in experiment.parts("world.features")),
        "An agent that leaves the map on one side enters it on the opposite side.",
    )


def _describe_senses(experiment: Experiment, appearance: Appearance) -> str:
    radius = experiment.senses.visual_radius
    visual_range = f"The pale disc is the visual range of an agent, {radius:g} map units."
    brightness = ", more brightly for larger values" if experiment.real_valued else ""
    sectors = f"A sector lights up while its sensor is active{brightness}."
    has_sectors = any(sector is not None for sector in appearance.sectors)
    return _join_sentences(
        *(_summary_of_part(sense) for sense in experiment.parts("senses.kinds")),
        visual_range if has_sectors else "",
        sectors if has_sectors else "",
    )


def _describe_network(experiment: Experiment, appearance: Appearance) -> str:
    actions = appearance.actions
    body = experiment.part("motor.body")
    return _join_sentences(
        f"The network has {len(appearance.inputs)} inputs and {len(actions)} outputs:"
        f" {', '.join(actions)}.",
        "The agent performs the action with the largest output." if body.chooses else "",
        _summary_of_part(experiment.part("network.kind")),
        _summary_of_part(body),
    )


def _describe_learning(experiment: Experiment, appearance: Appearance) -> str:
    networks = appearance.modules
    genome = f"The genome encodes {len(networks)} networks: {' and '.join(networks)}."
    inheritance = experiment.part("evolution.inheritance")
    return _join_sentences(
        _summary_of_part(experiment.part("learning.rule")),
        genome if len(networks) > 1 else "",
        _summary_of_part(inheritance) if has_parent_teachers(experiment) else "",
    )


def _describe_observations(experiment: Experiment) -> str:
    contrast = "without learning" if experiment.learns else "with learning"
    return _join_sentences(
        "Filled agents have eaten. The bars under the map show when agents eat.",
        "Compare an early generation with a late one,"
        f" or this condition with a condition {contrast}.",
    )


def _summary_of_part(part: Any) -> str:
    """Return the first paragraph of a part's docstring, on one line."""
    first_paragraph = (type(part).__doc__ or "").split("\n\n")[0]
    return " ".join(first_paragraph.split())


def _join_sentences(*sentences: str) -> str:
    """Return the sentences that are not empty, as one text."""
    return " ".join(sentence for sentence in sentences if sentence)
