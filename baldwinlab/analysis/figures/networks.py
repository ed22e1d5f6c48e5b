"""Who lives there: what each kind of agent senses, the networks that it decides and learns by, and what it does."""

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
    DARK_GREY,
    GREY,
    ORANGE,
    PALE,
    WIDTH,
    styled,
)

ROW, HEAD = 1.0, 0.3  # inches: of a network, of the headings
LAYERS = (3.1, 5.7)  # inches from the left: where networks begin and end
MOST = 5  # units drawn of a layer
RADIUS, APART = 0.06, 0.19  # of a unit, and from one to the next


class Kind(NamedTuple):
    """Agents that are built alike."""

    name: str  # of the conditions in which they live
    lines: Sequence[str]  # what is said of them
    inputs: Sequence[str]
    hidden: Sequence[int]  # units of each hidden layer
    actions: Sequence[str]
    modules: Sequence[str]  # the networks of a genome; the first acts, the others teach it


@styled
def networks(kinds: Sequence[Kind]) -> Figure:
    """Kind below kind: senses on the left, networks in the middle, actions on the right, and who teaches whom."""
    height = HEAD + ROW * sum(len(kind.modules) for kind in kinds)
    figure = Figure((WIDTH, height))
    figure.set_layout_engine("none")  # in inches, from edge to edge
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, WIDTH), ylim=(0, height))
    axes.axis("off")
    for place, heading in zip(
        (LAYERS[0] - 0.3, sum(LAYERS) / 2, LAYERS[1] + 0.3),
        ("senses", "networks", "actions"),
        strict=True,
    ):
        axes.text(place, height - 0.05, heading, ha="center", va="top", color=GREY)
    foot = height - HEAD
    for kind in kinds:
        _kind(axes, kind, foot - ROW / 2)
        foot -= ROW * len(kind.modules)
        if kind is not kinds[-1]:
            axes.axhline(foot, color=PALE, lw=0.8)
    return figure


def _kind(axes: Axes, kind: Kind, middle: float) -> None:
    """Agents of a kind; `middle` is that of the network they act by."""
    axes.text(0.05, middle + 0.22, kind.name, fontweight="bold", va="center")
    axes.text(0.05, middle + 0.1, "\n".join(kind.lines), va="top", color=DARK_GREY, linespacing=1.4)
    acts, *teachers = kind.modules
    _module(axes, kind, middle, BLUE, acts)
    for names, place, side in (
        (kind.inputs, LAYERS[0] - 0.14, "right"),
        (kind.actions, LAYERS[1] + 0.14, "left"),
    ):
        for name, height in zip(names, _heights(len(names), middle), strict=False):
            axes.text(place, height, name, ha=side, va="center")
    for name, _, does in (teacher.partition(": ") for teacher in teachers):
        _module(axes, kind, middle - ROW, GREY, name)
        arrow = {"arrowstyle": "->", "color": BLACK, "lw": 1.2}
        axes.annotate(
            "", (LAYERS[1], middle - 0.27), (LAYERS[1], middle - ROW + 0.4), arrowprops=arrow
        )
        axes.text(
            LAYERS[1] + 0.14,
            middle - ROW / 2,
            does.replace(", ", ",\n"),
            va="center",
            color=DARK_GREY,
        )


def _module(axes: Axes, kind: Kind, middle: float, colour: str, name: str) -> None:
    """A network, its name below."""
    layers = [len(kind.inputs), *kind.hidden, len(kind.actions)]
    step = (LAYERS[1] - LAYERS[0]) / (len(layers) - 1)
    units = [
        [(LAYERS[0] + number * step, y) for y in _heights(count, middle)]
        for number, count in enumerate(layers)
    ]
    lines = [(one, other) for left, right in pairwise(units) for one in left for other in right]
    axes.add_collection(
        LineCollection(lines, colors=colour, linewidths=0.4, alpha=0.6), autolim=False
    )
    for number, layer in enumerate(units):
        for place in layer:
            axes.add_patch(
                Circle(
                    place, RADIUS, fc=ORANGE if number == 0 else "white", ec=BLACK, lw=0.7, zorder=2
                )
            )
    sizes = " - ".join(map(str, layers))
    axes.text(sum(LAYERS) / 2, middle - 0.3, f"{name}, {sizes} units", ha="center", va="top")


def _heights(count: int, middle: float) -> list[float]:
    """Of the units of a layer, from the top; of many, a few."""
    shown = min(count, MOST)
    apart = min(APART, 0.54 / max(shown - 1, 1))
    return [middle + 0.08 + apart * ((shown - 1) / 2 - number) for number in range(shown)]
