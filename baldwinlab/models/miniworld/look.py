"""How a world of foragers looks, as data: what agents sense and do by name, what lies in the world, and in which colours.

Whoever draws or labels takes it from here: recordings and the page's script, traces, movies. Colours are names of
`baldwinlab.palette`, or "#rrggbb". Degrees grow clockwise, from where the agent heads; lengths are units of length.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple

from baldwinlab.experiment import Experiment, World
from baldwinlab.models.miniworld.state import HEADING_COUNT


class Sector(NamedTuple):
    """Where an input looks."""

    from_degrees: float
    to_degrees: float
    radius: float
    colour: str = "lit"  # while the input is not 0


class Kind(NamedTuple):
    """Items of one kind; they are numbered kind after kind."""

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


class Look(NamedTuple):
    inputs: tuple[str, ...]
    sectors: tuple[Sector | None, ...]  # of each input; None for one that looks nowhere
    actions: tuple[str, ...]
    headings: int  # a heading is written in turns of 360 degrees / headings
    item_kinds: tuple[Kind, ...]
    marks: tuple[Mark, ...]
    modules: tuple[str, ...]  # the networks of a genome, in words

    def to_dict(self) -> dict[str, Any]:
        """For JSON: parts by name."""
        plain = self._asdict()
        for name in ("sectors", "item_kinds", "marks"):
            plain[name] = [part and part._asdict() for part in plain[name]]
        return plain


def look(experiment: Experiment) -> Look:
    radius = experiment.senses.visual_radius
    modules = ("action module", "reinforcement module: teaches, fixed for life")
    return Look(
        inputs=("left", "front", "right"),
        sectors=(Sector(-45, -15, radius), Sector(-15, 15, radius), Sector(15, 45, radius)),
        actions=("left", "forward", "right"),
        headings=HEADING_COUNT,
        item_kinds=(Kind("food", "green", sum(region.count for region in experiment.world.food)),),
        marks=_marks(experiment.world),
        modules=modules[: len(experiment.modules)],
    )


def _marks(world: World) -> tuple[Mark, ...]:
    (x, y, radius), across = (world.start.x, world.start.y, world.start.radius), 2 * world.start.radius
    food = [Mark("rectangle", r.x[0], r.y[0], r.x[1] - r.x[0], r.y[1] - r.y[0], "region", "food") for r in world.food]
    return (*food, Mark("disc", x - radius, y - radius, across, across, "edge", "start"))


def as_text(experiment: Experiment) -> str:
    """The look as JSON text, for an attribute of a dataset."""
    return json.dumps(look(experiment).to_dict())
