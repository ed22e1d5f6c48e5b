"""How a world of foragers looks, as data: what agents sense and do by name, what lies in the world, and in which colours.

Whoever draws or labels takes it from here: recordings and the page's script, traces, movies. Colours are names of
`baldwinlab.analysis.figures.palette`, or "#rrggbb". Degrees grow clockwise, from where the agent heads; lengths are units of length.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import item_regions
from baldwinlab.models.miniworld.state import HEADING_COUNT


class Sector(NamedTuple):
    """Where an input looks."""

    from_degrees: float
    to_degrees: float
    radius: float
    colour: str = "lit"  # while the input is not 0


class Kind(NamedTuple):
    """Items of a kind; items are numbered in the order of these, in which a kind may come again."""

    name: str
    colour: str
    number: int  # of them


class Mark(NamedTuple):
    """What else is drawn on the map: its box."""

    kind: str  # rectangle or disc
    x: float
    y: float
    width: float
    height: float
    colour: str
    label: str
    solid: bool = False  # a wall, say; otherwise only where something may be


class Appearance(NamedTuple):
    inputs: tuple[str, ...]
    real: tuple[
        bool, ...
    ]  # of each input, whether it is a number between 0 and 1, and not just one of them
    sectors: tuple[Sector | None, ...]  # of each input; None for one that looks nowhere
    actions: tuple[str, ...]
    headings: int  # a heading is written in turns of 360 degrees / headings
    item_kinds: tuple[Kind, ...]
    marks: tuple[Mark, ...]
    modules: tuple[str, ...]  # the networks of a genome, in words
    answers: tuple[
        str, ...
    ]  # the first outputs of the second of them; none where these are actions, too
    memory: tuple[
        tuple[int, int], ...
    ]  # pairs of a network's units: the second remembers the first
    lessons: bool  # whether it is known from whom each learns

    def to_dict(self) -> dict[str, Any]:
        """For JSON: parts by name."""
        plain = self._asdict()
        for name in ("sectors", "item_kinds", "marks"):
            plain[name] = [part and part._asdict() for part in plain[name]]
        return plain


def describe_appearance(experiment: Experiment) -> Appearance:
    radius = experiment.senses.visual_radius
    senses = experiment.parts("senses.kinds")
    sectors = [sector for sense in senses for sector in sense.sectors]
    rule, network = experiment.part("learning.rule"), experiment.part("network.kind")
    return Appearance(
        inputs=experiment.inputs,
        real=tuple(sense.is_continuous for sense in senses for _ in sense.inputs),
        sectors=tuple(
            Sector(sector[0], sector[1], radius) if sector else None for sector in sectors
        ),
        actions=experiment.actions,
        headings=HEADING_COUNT,
        item_kinds=tuple(
            Kind(region.kind, region.color, region.count) for region in item_regions(experiment)
        ),
        marks=_marks(experiment),
        modules=_networks(experiment.modules, rule.answers),
        answers=rule.answers,
        memory=network.memory(
            len(experiment.inputs), experiment.network.hidden, len(experiment.actions)
        ),
        lessons=bool(rule.teacher_array),
    )


def _networks(modules: tuple[str, ...], answers: tuple[str, ...]) -> tuple[str, ...]:
    does = " and ".join(answers) or "teaches"
    words = {
        "action": "action module",
        "reinforcement": f"reinforcement module: {does}, does not learn",
    }
    return tuple(words[module] for module in modules if module in words)


def _marks(experiment: Experiment) -> tuple[Mark, ...]:
    """Regions of items, where agents are born, and what features add."""
    start = experiment.world.start
    around = (
        (start.x - start.radius, start.x + start.radius),
        (start.y - start.radius, start.y + start.radius),
    )
    regions = [
        _mark("rectangle", region.x, region.y, region.color, region.kind)
        for region in item_regions(experiment)
    ]
    features = [
        _mark(mark["shape"], mark["x"], mark["y"], mark["color"], mark["label"], solid=True)
        for feature in experiment.parts("world.features")
        for mark in feature.map_shapes()
    ]
    return (*regions, _mark("disc", *around, "edge", "start"), *features)


def _mark(
    kind: str,
    x: tuple[float, float],
    y: tuple[float, float],
    colour: str,
    label: str,
    solid: bool = False,
) -> Mark:
    return Mark(kind, x[0], y[0], x[1] - x[0], y[1] - y[0], colour, label, solid)


def appearance_json(experiment: Experiment) -> str:
    """The look as JSON text, for an attribute of a dataset."""
    return json.dumps(describe_appearance(experiment).to_dict())
