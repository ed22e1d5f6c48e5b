"""The world as the agents find it, to scale: the maps, and what an agent senses. y points down, as on a screen.

Source: the paper, "The Simulated World of Foods and Agents".
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle, Wedge

from baldwinlab.experiment import Experiment, World
from baldwinlab.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, WIDTH, styled

BODY = 10.0  # side of an agent and of an item, units of length
EXAMPLE = 1906  # seed of the places shown


@styled
def world_maps(worlds: Mapping[str, World], agents: int) -> Figure:
    """Each world by its title: where `agents` are born, where food lies, and an example of both. Bodies are to scale."""
    columns = min(len(worlds), 3)
    rows = -(-len(worlds) // columns)
    figure = Figure((min(WIDTH, 3.6 * columns), rows * (3.5 if columns < 3 else 2.5)))
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, (title, world) in zip(grid.flat, worlds.items(), strict=False):
        _map(axes, world, agents)
        axes.set_title(title, loc="left", fontweight="bold")
    for axes in grid.flat[len(worlds) :]:
        axes.set_visible(False)
    return figure


def _map(axes: Axes, world: World, agents: int) -> None:
    generator = np.random.default_rng(EXAMPLE)
    lay_out(axes, world)
    start = world.start
    axes.annotate("born here,\nheading right", (start.x, start.y + start.radius + 8), ha="center", va="top")
    angle, distance = generator.uniform(0, 2 * np.pi, agents), start.radius * np.sqrt(generator.uniform(size=agents))
    x, y = start.x + distance * np.cos(angle), start.y + distance * np.sin(angle)
    _squares(axes, x, y, BLUE)
    axes.hlines(y, x, x + 1.2 * BODY, color=BLACK, lw=0.9)
    for region in world.food:
        _squares(axes, generator.uniform(*region.x, region.count), generator.uniform(*region.y, region.count), ORANGE)
        items = f"{region.count} item{'' if region.count == 1 else 's'}"
        axes.annotate(items, (sum(region.x) / 2, region.y[0] - 8), ha="center", va="bottom")


def lay_out(axes: Axes, world: World) -> None:
    """An empty map: edges, start disc, food regions."""
    axes.set(xlim=(0, world.width), ylim=(world.height, 0), aspect="equal")
    quarters = np.linspace(0, 1, 5)
    axes.set_xticks(quarters * world.width)
    axes.set_yticks(quarters * world.height)
    axes.spines[:].set_visible(True)
    axes.add_patch(Circle((world.start.x, world.start.y), world.start.radius, fill=False, ec=BLUE, ls="--", lw=1))
    for region in world.food:
        corner, size = (region.x[0], region.y[0]), (region.x[1] - region.x[0], region.y[1] - region.y[0])
        axes.add_patch(Rectangle(corner, *size, fc=ORANGE, alpha=0.15, lw=0))
        axes.add_patch(Rectangle(corner, *size, fill=False, ec=ORANGE, lw=1))


def _squares(axes: Axes, x: np.ndarray, y: np.ndarray, colour: str) -> None:
    squares = [Rectangle((left - BODY / 2, top - BODY / 2), BODY, BODY) for left, top in zip(x, y, strict=True)]
    axes.add_collection(PatchCollection(squares, facecolor=colour, edgecolor="white", linewidth=0.3))


@styled
def agent_senses(experiment: Experiment) -> Figure:
    """An agent heading right, its three sensors to scale, and an item that the right one sees."""
    radius = experiment.senses.visual_radius
    figure = Figure((3.6, 3.1))
    axes = figure.subplots()
    sectors = (("left", -45, -15, SKY), ("front", -15, 15, GREEN), ("right", 15, 45, VERMILION))
    for name, first, past, colour in sectors:
        axes.add_patch(Wedge((0, 0), radius, first, past, fc=colour, alpha=0.35, ec=colour, lw=1))
        middle = np.radians((first + past) / 2)
        axes.text(1.06 * radius * np.cos(middle), 1.06 * radius * np.sin(middle), name, ha="left", va="center", fontweight="bold")
    for edge in (-45, -15, 15, 45):
        direction = 1.1 * radius * np.array([np.cos(np.radians(edge)), np.sin(np.radians(edge))])
        axes.text(direction[0], direction[1], f"{abs(edge)}°", ha="center", va="center", color=GREY)
    axes.add_patch(Circle((0, 0), radius, fill=False, ec=GREY, ls="--", lw=1))
    axes.text(0, -1.05 * radius, f"sees to {radius:g} units", ha="center", va="bottom", color=GREY)
    axes.annotate("", (0.45 * radius, 0), (0, 0), arrowprops={"arrowstyle": "->", "color": BLACK})
    item = 0.78 * radius * np.array([np.cos(np.radians(30)), np.sin(np.radians(30))])
    for (x, y), colour in (((0.0, 0.0), BLUE), (item, ORANGE)):
        axes.add_patch(Rectangle((x - BODY / 2, y - BODY / 2), BODY, BODY, fill=False, ec=colour, lw=1.6))
        axes.plot(x, y, "o", color=colour, ms=4)
    axes.text(-BODY / 2, BODY / 2, "agent ", ha="right", va="top")
    axes.text(item[0], item[1] + 0.55 * BODY, "item", ha="center", va="top")
    reach = 1.2 * max(radius, 0.8 * BODY)
    axes.set(xlim=(-0.9 * reach, 1.2 * reach), ylim=(reach, -reach), aspect="equal")
    axes.axis("off")
    return figure
