"""Appearance of a MiniWorld, as data and in brief sentences, from the settings and parts.

The data contains the names of inputs and actions, items, shapes and colors. Recordings, the lab,
traces and movies use the data to draw and label. Colors are names of `baldwinlab.analysis.palette`,
or "#rrggbb". Degrees are clockwise from the heading. Lengths are in units of length.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, NamedTuple

from baldwinlab.evolution import has_parent_teachers
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.species import combine_inputs
from baldwinlab.models.miniworld.regions import item_regions
from baldwinlab.models.miniworld.state import HEADING_COUNT


class Sector(NamedTuple):
    """The sector of the map in which an input senses."""

    from_degrees: float
    to_degrees: float
    radius: float
    # Color while the input is not 0.
    color: str = "lit"


class Kind(NamedTuple):
    """The items of one region. The indices of items follow the order of regions."""

    name: str
    color: str
    # Number of items.
    number: int


class Mark(NamedTuple):
    """A shape on the map, with the bounding box. Items are no marks."""

    # "rectangle" or "disc".
    kind: str
    x: float
    y: float
    width: float
    height: float
    color: str
    label: str
    # True for shapes that block, such as walls.
    solid: bool = False


class Appearance(NamedTuple):
    """The data to draw and label a MiniWorld."""

    inputs: tuple[str, ...]
    # Per input: whether the input is real-valued.
    is_continuous: tuple[bool, ...]
    # Per input: the sector in which the input senses, or None.
    sectors: tuple[Sector | None, ...]
    actions: tuple[str, ...]
    # Number of headings in a full turn.
    headings: int
    item_kinds: tuple[Kind, ...]
    marks: tuple[Mark, ...]
    # Descriptions of the networks of a genome.
    modules: tuple[str, ...]
    # Names of the first outputs of the second network. Empty if all outputs are actions.
    answers: tuple[str, ...]
    # Pairs of units: the second unit stores the previous activation of the first unit.
    memory: tuple[tuple[int, int], ...]
    # Whether the teacher of each agent is recorded.
    has_teachers: bool

    def to_dict(self) -> dict[str, Any]:
        """Return the data for JSON."""
        plain = self._asdict()
        for name in ("sectors", "item_kinds", "marks"):
            plain[name] = [None if entry is None else entry._asdict() for entry in plain[name]]
        return plain


def describe_appearance(experiment: Experiment) -> Appearance:
    """Return the appearance of the world of an experiment, with the inputs of all species."""
    if members := experiment.species_experiments():
        return _join_appearances([describe_appearance(member) for member in members])
    radius = experiment.senses.visual_radius
    senses = experiment.parts("senses.kinds")
    sectors = [sector for sense in senses for sector in sense.sectors]
    rule = experiment.part("learning.rule")
    network = experiment.part("network.kind")
    return Appearance(
        inputs=experiment.inputs,
        is_continuous=tuple(sense.is_continuous for sense in senses for _ in sense.inputs),
        sectors=tuple(
            Sector(from_degrees=sector[0], to_degrees=sector[1], radius=radius) if sector else None
            for sector in sectors
        ),
        actions=experiment.actions,
        headings=HEADING_COUNT,
        item_kinds=tuple(
            Kind(name=region.kind, color=region.color, number=region.count)
            for region in item_regions(experiment)
        ),
        marks=_list_marks(experiment),
        modules=_module_descriptions(experiment.modules, rule.answers),
        answers=rule.answers,
        memory=network.memory(
            len(experiment.inputs), experiment.network.hidden, len(experiment.actions)
        ),
        has_teachers=bool(rule.teacher_array),
    )


def _join_appearances(appearances: Sequence[Appearance]) -> Appearance:
    """Return the appearance of a world of several species.

    The order of the inputs is that of `combine_inputs`. Networks are not described, because species
    have different networks. Other fields are from the species with the most actions.
    """
    inputs, indices = combine_inputs([appearance.inputs for appearance in appearances])
    values: dict[int, tuple[bool, Sector | None]] = {}
    for appearance, indices_of_species in zip(appearances, indices, strict=True):
        values_of_species = zip(appearance.is_continuous, appearance.sectors, strict=True)
        values |= zip(indices_of_species, values_of_species, strict=True)
    is_continuous, sectors = zip(*(values[index] for index in range(len(inputs))), strict=True)
    return max(appearances, key=lambda appearance: len(appearance.actions))._replace(
        inputs=inputs,
        is_continuous=is_continuous,
        sectors=sectors,
        modules=(),
        answers=(),
        memory=(),
        has_teachers=False,
    )


def _module_descriptions(modules: tuple[str, ...], answers: tuple[str, ...]) -> tuple[str, ...]:
    """Return a description of each network of a genome."""
    purpose = " and ".join(answers) or "teaches"
    descriptions = {
        "action": "action module",
        "reinforcement": f"reinforcement module: {purpose}, does not learn",
    }
    return tuple(descriptions[module] for module in modules if module in descriptions)


def _list_marks(experiment: Experiment) -> tuple[Mark, ...]:
    """Return the marks of the regions of items, the start disc, and the shapes of features."""
    start = experiment.world.start
    start_box = (
        (start.x - start.radius, start.x + start.radius),
        (start.y - start.radius, start.y + start.radius),
    )
    regions = [
        _make_mark("rectangle", region.x, region.y, region.color, region.kind)
        for region in item_regions(experiment)
    ]
    features = [
        _make_mark(mark["shape"], mark["x"], mark["y"], mark["color"], mark["label"], solid=True)
        for feature in experiment.parts("world.features")
        for mark in feature.map_shapes()
    ]
    return (*regions, _make_mark("disc", *start_box, "edge", "start"), *features)


def _make_mark(
    kind: str,
    x: tuple[float, float],
    y: tuple[float, float],
    color: str,
    label: str,
    solid: bool = False,
) -> Mark:
    """Return a mark that covers the ranges `x` and `y`."""
    (left, right), (upper, lower) = x, y
    return Mark(kind, left, upper, right - left, lower - upper, color, label, solid)


def appearance_json(experiment: Experiment) -> str:
    """Return the appearance as JSON, for an attribute of the dataset of a trace."""
    return json.dumps(describe_appearance(experiment).to_dict())


class Topic(NamedTuple):
    """A heading, and a text of brief sentences."""

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
