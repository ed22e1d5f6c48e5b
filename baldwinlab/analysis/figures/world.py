"""The world as the agents find it, to scale: the maps, and what an agent senses. y points down, as on a screen.

What is drawn beside the map's edges and the place of birth is what the parts declare, the *look* that traces carry as their
attribute; where it is not known, because parts are not here, the experiment's own food. Source: the paper, "The Simulated World
of Foods and Agents".
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse, Rectangle, Wedge
from matplotlib.patheffects import withStroke

from baldwinlab.analysis.figures.palette import shade
from baldwinlab.analysis.figures.style import BLACK, BLUE, GREY, ORANGE, PALE, WIDTH, styled
from baldwinlab.experiment import FoodRegion, World

BODY = 10.0  # side of an agent and of an item, units of length
NARROW = 10  # degrees
EXAMPLE = 1906  # seed of the places shown
HALO = [withStroke(linewidth=2, foreground="white")]  # of a text that lies on items

Look = Mapping[str, Any]  # `models.miniworld.look.Look` as plain data


@styled
def world_maps(
    worlds: Mapping[str, World], agents: int, looks: Mapping[str, Look] = MappingProxyType({})
) -> Figure:
    """Each world by its title: where `agents` are born, where items lie, and an example of both. Bodies are to scale.

    `looks` are those of the worlds, by title, as far as they are known.
    """
    columns = min(len(worlds), 3)
    rows = -(-len(worlds) // columns)
    figure = Figure((min(WIDTH, 3.6 * columns), rows * (3.5 if columns < 3 else 2.5)))
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, (title, world) in zip(grid.flat, worlds.items(), strict=False):
        _map(axes, world, agents, looks.get(title) or look_of_food(world))
        axes.set_title(title, loc="left", fontweight="bold")
    for axes in grid.flat[len(worlds) :]:
        axes.set_visible(False)
    return figure


def look_of_food(world: World) -> Look:
    """What can be said of a world's look without asking parts: its food."""
    marks = [_mark(region) for region in world.food]
    return {
        "marks": marks,
        "item_kinds": [
            {"name": "food", "colour": "green", "number": region.count} for region in world.food
        ],
    }


def _mark(region: FoodRegion) -> dict[str, Any]:
    (left, right), (top, bottom) = region.x, region.y
    place = {"x": left, "y": top, "width": right - left, "height": bottom - top}
    return {"kind": "rectangle", **place, "colour": "green", "label": "food", "solid": False}


def _map(axes: Axes, world: World, agents: int, look: Look) -> None:
    generator = np.random.default_rng(EXAMPLE)
    lay_out(axes, world, look)
    start = world.start
    axes.annotate(
        "born here,\nheading right",
        (start.x, start.y + start.radius + 8),
        ha="center",
        va="top",
        path_effects=HALO,
    )
    angle, distance = (
        generator.uniform(0, 2 * np.pi, agents),
        start.radius * np.sqrt(generator.uniform(size=agents)),
    )
    x, y = start.x + distance * np.cos(angle), start.y + distance * np.sin(angle)
    _squares(axes, x, y, BLUE)
    axes.hlines(y, x, x + 1.2 * BODY, color=BLACK, lw=0.9)
    labels: dict[
        tuple[float, float, float], list[str]
    ] = {}  # regions that lie on each other are labelled together
    for region, kind in zip(_regions(look), look["item_kinds"], strict=True):
        right, bottom, count = (
            region["x"] + region["width"],
            region["y"] + region["height"],
            kind["number"],
        )
        _squares(
            axes,
            generator.uniform(region["x"], right, count),
            generator.uniform(region["y"], bottom, count),
            shade(kind["colour"]),
        )
        items = (
            f"item{'' if count == 1 else 's'}" if kind["name"] == "food" else f"of {kind['name']}"
        )
        labels.setdefault((region["x"], right, region["y"] - 8), []).append(f"{count} {items}")
    for (left, right, top), texts in labels.items():
        ends = (
            left + right
        ) / 2 > world.width / 2  # where the region does, so that a long text stays on the map
        place = (right if ends else (left + right) / 2, top)
        axes.annotate(
            ", ".join(texts),
            place,
            ha="right" if ends else "center",
            va="bottom",
            path_effects=HALO,
        )


def _regions(look: Look) -> list[Mapping[str, Any]]:
    """Where items lie, one of `item_kinds` after the other."""
    return [mark for mark in look["marks"] if mark["kind"] == "rectangle" and not mark["solid"]]


def lay_out(axes: Axes, world: World, look: Look) -> None:
    """An empty map: edges, start disc, regions of items, and what else stands there."""
    axes.set(xlim=(0, world.width), ylim=(world.height, 0), aspect="equal")
    quarters = np.linspace(0, 1, 5)
    axes.set_xticks(quarters * world.width)
    axes.set_yticks(quarters * world.height)
    axes.spines[:].set_visible(True)
    axes.add_patch(
        Circle(
            (world.start.x, world.start.y), world.start.radius, fill=False, ec=BLUE, ls="--", lw=1
        )
    )
    for region in _regions(look):
        corner, size, colour = (
            (region["x"], region["y"]),
            (region["width"], region["height"]),
            shade(region["colour"]),
        )
        axes.add_patch(Rectangle(corner, *size, fc=colour, alpha=0.15, lw=0))
        axes.add_patch(Rectangle(corner, *size, fill=False, ec=colour, lw=1))
    for mark in (mark for mark in look["marks"] if mark["solid"]):
        _stand(axes, mark)


def _stand(axes: Axes, mark: Mapping[str, Any]) -> None:
    """What stands on the map, with its name."""
    width, height = mark["width"], mark["height"]
    middle = mark["x"] + width / 2, mark["y"] + height / 2
    shape = (
        Ellipse(middle, width, height)
        if mark["kind"] == "disc"
        else Rectangle((mark["x"], mark["y"]), width, height)
    )
    shape.set(facecolor=shade(mark["colour"]), linewidth=0, zorder=2)
    axes.add_patch(shape)
    axes.annotate(mark["label"], (mark["x"] + width + 8, middle[1]), ha="left", va="center")


def _squares(axes: Axes, x: np.ndarray, y: np.ndarray, colour: str) -> None:
    squares = [
        Rectangle((left - BODY / 2, top - BODY / 2), BODY, BODY)
        for left, top in zip(x, y, strict=True)
    ]
    axes.add_collection(
        PatchCollection(squares, facecolor=colour, edgecolor="white", linewidth=0.3)
    )


def sectors(look: Look) -> dict[tuple[float, float, float], list[str]]:
    """Where inputs look, (from, to, radius), in degrees clockwise from where the agent heads, and the names of those that do."""
    found: dict[tuple[float, float, float], list[str]] = {}
    for name, sector in zip(look["inputs"], look["sectors"], strict=True):
        if sector:
            found.setdefault(
                (sector["from_degrees"], sector["to_degrees"], sector["radius"]), []
            ).append(name)
    return found


@styled
def agent_senses(look: Look) -> Figure:
    """An agent heading right, to scale, the sectors in which its inputs look, and an item in the last, which lights up."""
    found = sectors(look)
    radius = max((distance for _, _, distance in found), default=4 * BODY)
    figure = Figure((3.6, 3.1))
    axes = figure.subplots()
    for number, ((first, past, distance), names) in enumerate(found.items(), 1):
        colour = (
            ORANGE if number == len(found) else PALE
        )  # as in the lab, that of an input which is not 0
        axes.add_patch(Wedge((0, 0), distance, first, past, fc=colour, alpha=0.55, ec=GREY, lw=1))
        _at(
            axes,
            1.06 * radius,
            _middle(first, past),
            "\n".join(names),
            ha="left",
            va="center",
            fontweight="bold",
        )
    wide = [
        (first, past) for first, past, _ in found if (past - first) % 360 > NARROW
    ]  # edges of others leave no room for words
    for edge in dict.fromkeys(edge for pair in wide for edge in pair):
        _at(
            axes,
            1.1 * radius,
            edge,
            f"{abs((edge + 180) % 360 - 180):g}°",
            ha="center",
            va="center",
            color=GREY,
        )
    axes.add_patch(Circle((0, 0), radius, fill=False, ec=GREY, ls="--", lw=1))
    axes.text(
        0,
        -1.05 * radius,
        f"sees to {radius:g} units" if found else "looks nowhere in particular",
        ha="center",
        va="bottom",
        color=GREY,
    )
    axes.annotate("", (0.45 * radius, 0), (0, 0), arrowprops={"arrowstyle": "->", "color": BLACK})
    _body(axes, 0.0, 0.0, BLUE)
    axes.text(-BODY / 2, BODY / 2, "agent ", ha="right", va="top")
    for first, past, distance in list(found)[-1:]:
        x, y = _on_circle(0.78 * distance, _middle(first, past))
        _body(axes, x, y, shade(look["item_kinds"][-1]["colour"]) if look["item_kinds"] else GREY)
        axes.text(x, y + 0.55 * BODY, "item", ha="center", va="top")
    reach = 1.2 * max(radius, 0.8 * BODY)
    axes.set(xlim=(-0.9 * reach, 1.2 * reach), ylim=(reach, -reach), aspect="equal")
    axes.axis("off")
    return figure


def _middle(first: float, past: float) -> float:
    """Of a sector, degrees."""
    return first + (past - first) % 360 / 2


def _on_circle(radius: float, degrees: float) -> tuple[float, float]:
    return radius * float(np.cos(np.radians(degrees))), radius * float(np.sin(np.radians(degrees)))


def _at(axes: Axes, radius: float, degrees: float, text: str, **how: Any) -> None:
    axes.text(*_on_circle(radius, degrees), text, **how)


def _body(axes: Axes, x: float, y: float, colour: str) -> None:
    axes.add_patch(
        Rectangle((x - BODY / 2, y - BODY / 2), BODY, BODY, fill=False, ec=colour, lw=1.6)
    )
    axes.plot(x, y, "o", color=colour, ms=4)
