"""Draw what each kind of agent senses, its networks, and its actions."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from baldwinlab.analysis.figures.style import (
    BLACK,
    BLUE,
    DARK_GRAY,
    FIGURE_WIDTH,
    GRAY,
    ORANGE,
    PALE,
    styled,
)

# Inches: height of a network and of the headings.
ROW = 1.0
HEAD = 0.3
# Inches from the left edge: first and last layer of a network.
FIRST_LAYER = 3.1
LAST_LAYER = 5.7
MIDDLE = (FIRST_LAYER + LAST_LAYER) / 2
# Units drawn per layer.
MAX_UNITS = 5
# Inches: radius of a unit, and distance between units.
RADIUS = 0.06
DISTANCE = 0.19


class AgentKind(NamedTuple):
    """Agents with the same structure.

    Attributes
    ----------
    name : str
        The conditions of these agents.
    lines : sequence of str
        The description, line by line.
    inputs, actions : sequence of str
        Names of the inputs and outputs.
    hidden : sequence of int
        Units of each hidden layer.
    modules : sequence of str
        The networks of a genome. The first network acts. The others teach it, and are named
        "NAME: EFFECT".
    """

    name: str
    lines: Sequence[str]
    inputs: Sequence[str]
    hidden: Sequence[int]
    actions: Sequence[str]
    modules: Sequence[str]


@styled
def draw_networks(kinds: Sequence[AgentKind]) -> Figure:
    """Draw senses, networks and actions of each kind of agent, one kind below another."""
    height = HEAD + ROW * sum(len(kind.modules) for kind in kinds)
    figure = Figure((FIGURE_WIDTH, height))
    # Coordinates are inches, so there is no layout.
    figure.set_layout_engine("none")
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, FIGURE_WIDTH), ylim=(0, height))
    axes.axis("off")
    headings = {
        "senses": FIRST_LAYER - 0.3,
        "networks": MIDDLE,
        "actions": LAST_LAYER + 0.3,
    }
    for heading, x in headings.items():
        axes.text(x, height - 0.05, heading, ha="center", va="top", color=GRAY)
    bottom = height - HEAD
    for kind in kinds:
        _draw_kind(axes, kind, bottom - ROW / 2)
        bottom -= ROW * len(kind.modules)
        if kind is not kinds[-1]:
            axes.axhline(bottom, color=PALE, lw=0.8)
    return figure


def _draw_kind(axes: Axes, kind: AgentKind, middle: float) -> None:
    """Draw a kind of agent; `middle` is the height of the acting network."""
    axes.text(0.05, middle + 0.22, kind.name, fontweight="bold", va="center")
    description = "\n".join(kind.lines)
    axes.text(0.05, middle + 0.1, description, va="top", color=DARK_GRAY, linespacing=1.4)
    actor, *teachers = kind.modules
    _draw_module(axes, kind, middle, BLUE, actor)
    _draw_names(axes, kind.inputs, FIRST_LAYER - 0.14, "right", middle)
    _draw_names(axes, kind.actions, LAST_LAYER + 0.14, "left", middle)
    for teacher in teachers:
        _draw_teacher(axes, kind, teacher, middle)


def _draw_names(axes: Axes, names: Sequence[str], x: float, align: str, middle: float) -> None:
    for name, height in zip(names, _unit_heights(len(names), middle), strict=False):
        axes.text(x, height, name, ha=align, va="center")


def _draw_teacher(axes: Axes, kind: AgentKind, teacher: str, middle: float) -> None:
    """Draw a teaching network, with an arrow to the acting network."""
    name, _, effect = teacher.partition(": ")
    _draw_module(axes, kind, middle - ROW, GRAY, name)
    axes.annotate(
        "",
        (LAST_LAYER, middle - 0.27),
        (LAST_LAYER, middle - ROW + 0.4),
        arrowprops={"arrowstyle": "->", "color": BLACK, "lw": 1.2},
    )
    text = effect.replace(", ", ",\n")
    axes.text(LAST_LAYER + 0.14, middle - ROW / 2, text, va="center", color=DARK_GRAY)


def _draw_module(axes: Axes, kind: AgentKind, middle: float, color: str, name: str) -> None:
    """Draw a network with its name below."""
    layers = [len(kind.inputs), *kind.hidden, len(kind.actions)]
    step = (LAST_LAYER - FIRST_LAYER) / (len(layers) - 1)
    units = [
        [(FIRST_LAYER + number * step, y) for y in _unit_heights(count, middle)]
        for number, count in enumerate(layers)
    ]
    links = [(start, end) for left, right in pairwise(units) for start in left for end in right]
    lines = LineCollection(links, colors=color, linewidths=0.4, alpha=0.6)
    axes.add_collection(lines, autolim=False)
    for number, layer in enumerate(units):
        fill = ORANGE if number == 0 else "white"
        for position in layer:
            axes.add_patch(Circle(position, RADIUS, fc=fill, ec=BLACK, lw=0.7, zorder=2))
    sizes = " - ".join(map(str, layers))
    axes.text(MIDDLE, middle - 0.3, f"{name}, {sizes} units", ha="center", va="top")


def _unit_heights(count: int, middle: float) -> list[float]:
    """Return the heights of the units of a layer from the top, at most `MAX_UNITS`."""
    shown = min(count, MAX_UNITS)
    distance = min(DISTANCE, 0.54 / max(shown - 1, 1))
    return [middle + 0.08 + distance * ((shown - 1) / 2 - number) for number in range(shown)]
