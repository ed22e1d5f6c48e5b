"""Appearance of a MiniWorld, as data: names of inputs and actions, items, shapes and colors.

Recordings, the page, traces and movies use this data to draw and label. Colors are names of
`baldwinlab.analysis.palette`, or "#rrggbb". Degrees are clockwise from the heading.
Lengths are in units of length.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, NamedTuple

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
    """Items of a kind, in a region. Items are numbered in the order of regions."""

    name: str
    color: str
    # Number of items.
    number: int


class Mark(NamedTuple):
    """A shape on the map in addition to items, with its bounding box."""

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
    # Per input: whether it is real-valued.
    is_continuous: tuple[bool, ...]
    # Per input: its sector, or None.
    sectors: tuple[Sector | None, ...]
    actions: tuple[str, ...]
    # Number of headings in a full turn.
    headings: int
    item_kinds: tuple[Kind, ...]
    marks: tuple[Mark, ...]
    # Descriptions of the networks of a genome.
    modules: tuple[str, ...]
    # Names of the first outputs of the second network. Empty if its outputs are actions.
    answers: tuple[str, ...]
    # Pairs of units: the second unit stores the last activation of the first unit.
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
    """Return the appearance of the world of an experiment; with species, with all their inputs."""
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

    The order of the inputs is that of `combine_inputs`. Networks are not described, because those
    of the species differ.
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
    """Return the regions of items, the start disc, and the shapes of features."""
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
    """Return a mark from its extents in x and y."""
    return Mark(
        kind=kind,
        x=x[0],
        y=y[0],
        width=x[1] - x[0],
        height=y[1] - y[0],
        color=color,
        label=label,
        solid=solid,
    )


def appearance_json(experiment: Experiment) -> str:
    """Return the appearance as JSON, for an attribute of a dataset."""
    return json.dumps(describe_appearance(experiment).to_dict())
