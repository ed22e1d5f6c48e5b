"""Figure of the inputs, networks and actions of each kind of agent."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

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
from baldwinlab.analysis.figures.world import Appearance
from baldwinlab.analysis.report.content import select_foragers
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import read_factors
from baldwinlab.papers import load

# Height of a network and of the headings, in inches.
ROW_HEIGHT = 1.0
HEADINGS_HEIGHT = 0.3
# Distance of the first and last layer of a network from the left edge, in inches.
FIRST_LAYER_X = 3.1
LAST_LAYER_X = 5.7
MIDDLE_X = (FIRST_LAYER_X + LAST_LAYER_X) / 2
# Largest number of units that are drawn per layer.
MAX_UNITS = 5
# Radius of a unit, and largest distance between units, in inches.
UNIT_RADIUS = 0.06
MAX_UNIT_DISTANCE = 0.19
# Largest distance of the first and last unit of a layer, in inches.
MAX_LAYER_HEIGHT = 0.54
# Distance from the center of a network up to the middle of its layers, in inches.
LAYERS_OFFSET = 0.08
# Distance between a unit and the name of the input or action, in inches.
NAME_DISTANCE = 0.14


class AgentKind(NamedTuple):
    """Agents with the same structure."""

    name: str  # Learner of the conditions with such agents, such as "evo".
    lines: Sequence[str]  # Phrases on inheritance and on learning.
    inputs: Sequence[str]
    hidden: Sequence[int]  # Units of each hidden layer.
    actions: Sequence[str]
    # Descriptions of the networks of a genome. The first network acts. Each other network teaches
    # the first one, and has the description "NAME: EFFECT".
    modules: Sequence[str]


def draw_figure(report: ReportData) -> ReportFigure | None:
    """Draw the network of each learner, or return None without appearances."""
    if not report.appearances:
        return None
    paper = report.paper or load()
    experiments = select_foragers(report.experiments)
    kinds: dict[str, AgentKind] = {}
    for name, factors in read_factors(report.data).items():
        if name in report.appearances and name in experiments:
            kind = _make_kind(factors.learner, experiments[name], report.appearances[name])
            kinds.setdefault(factors.learner, kind)
    descriptions = " ".join(
        f"{learner}: {paper.describe(preset_kind, learner)}."
        for preset_kind in ("conditions", "controls")
        for learner in paper.names(preset_kind)
        if learner in kinds
    )
    alternatives = [
        f"{kind.name}: {', '.join(kind.lines)}; {' and '.join(kind.modules)}"
        for kind in kinds.values()
    ]
    return ReportFigure(
        title="The agents' networks",
        caption=(
            "The action module computes the action from the inputs (orange): the strongest output "
            "is the action. A second module, if there is one, receives the same inputs and keeps "
            "its weights from birth. Its outputs are the targets from which the action module "
            f"learns. {descriptions}"
        ),
        alternative=f"{'; '.join(alternatives)}.",
        figure=draw_networks(list(kinds.values())),
        table=_tabulate_modules(list(kinds.values())),
    )


def _make_kind(learner: str, experiment: Experiment, appearance: Appearance) -> AgentKind:
    inherits = experiment.evolution.inheritance != "none"
    heredity = (
        "evolves: inherits weights" if inherits else "does not evolve: new random\nweights at birth"
    )
    learning = (
        f"learns in its lifetime: {experiment.learning.rule}"
        if experiment.learns
        else "does not learn"
    )
    return AgentKind(
        name=learner,
        lines=(heredity, learning),
        inputs=appearance["inputs"],
        hidden=experiment.network.hidden,
        actions=appearance["actions"],
        modules=appearance["modules"],
    )


def _tabulate_modules(kinds: Sequence[AgentKind]) -> list[dict[str, Any]]:
    """Return the networks of agents: one row per kind of agent and module."""
    return [
        {
            "agents": kind.name,
            "module": module,
            "inputs": " ".join(kind.inputs),
            "hidden_units": " ".join(map(str, kind.hidden)),
            "outputs": " ".join(kind.actions),
        }
        for kind in kinds
        for module in kind.modules
    ]


@styled
def draw_networks(kinds: Sequence[AgentKind]) -> Figure:
    """Draw senses, networks and actions of each kind of agent, one kind below another."""
    height = HEADINGS_HEIGHT + ROW_HEIGHT * sum(len(kind.modules) for kind in kinds)
    figure = Figure((FIGURE_WIDTH, height))
    # Coordinates are inches, so no layout engine is needed.
    figure.set_layout_engine("none")
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, FIGURE_WIDTH), ylim=(0, height))
    axes.axis("off")
    headings = {
        "senses": FIRST_LAYER_X - 0.3,
        "networks": MIDDLE_X,
        "actions": LAST_LAYER_X + 0.3,
    }
    for heading, x in headings.items():
        axes.text(x, height - 0.05, heading, ha="center", va="top", color=GRAY)
    bottom = height - HEADINGS_HEIGHT
    for kind in kinds:
        _draw_kind(axes, kind, bottom - ROW_HEIGHT / 2)
        bottom -= ROW_HEIGHT * len(kind.modules)
        if kind is not kinds[-1]:
            axes.axhline(bottom, color=PALE, lw=0.8)
    return figure


def _draw_kind(axes: Axes, kind: AgentKind, center_y: float) -> None:
    """Draw a kind of agent. `center_y` is the height of the center of the acting network."""
    axes.text(0.05, center_y + 0.22, kind.name, fontweight="bold", va="center")
    description = "\n".join(kind.lines)
    axes.text(0.05, center_y + 0.1, description, va="top", color=DARK_GRAY, linespacing=1.4)
    actor, *teachers = kind.modules
    _draw_module(axes, kind, center_y, BLUE, actor)
    _draw_names(axes, kind.inputs, FIRST_LAYER_X - NAME_DISTANCE, "right", center_y)
    _draw_names(axes, kind.actions, LAST_LAYER_X + NAME_DISTANCE, "left", center_y)
    for teacher in teachers:
        _draw_teacher(axes, kind, teacher, center_y)


def _draw_names(axes: Axes, names: Sequence[str], x: float, align: str, center_y: float) -> None:
    # Units above `MAX_UNITS` are not drawn, so their names are left out.
    for name, y in zip(names, _unit_heights(len(names), center_y), strict=False):
        axes.text(x, y, name, ha=align, va="center")


def _draw_teacher(axes: Axes, kind: AgentKind, teacher: str, center_y: float) -> None:
    """Draw a teaching network, with an arrow to the acting network."""
    name, _, effect = teacher.partition(": ")
    _draw_module(axes, kind, center_y - ROW_HEIGHT, GRAY, name)
    axes.annotate(
        "",
        (LAST_LAYER_X, center_y - 0.27),
        (LAST_LAYER_X, center_y - ROW_HEIGHT + 0.4),
        arrowprops={"arrowstyle": "->", "color": BLACK, "lw": 1.2},
    )
    text = effect.replace(", ", ",\n")
    axes.text(
        LAST_LAYER_X + NAME_DISTANCE, center_y - ROW_HEIGHT / 2, text, va="center", color=DARK_GRAY
    )


def _draw_module(axes: Axes, kind: AgentKind, center_y: float, color: str, name: str) -> None:
    """Draw a network, and the name below the network."""
    # Number of units of each layer.
    layers = [len(kind.inputs), *kind.hidden, len(kind.actions)]
    layer_distance = (LAST_LAYER_X - FIRST_LAYER_X) / (len(layers) - 1)
    # Positions of the units, [layer][unit].
    units = []
    for layer_index, n_units in enumerate(layers):
        x = FIRST_LAYER_X + layer_index * layer_distance
        units.append([(x, y) for y in _unit_heights(n_units, center_y)])
    links = [(start, end) for left, right in pairwise(units) for start in left for end in right]
    lines = LineCollection(links, colors=color, linewidths=0.4, alpha=0.6)
    axes.add_collection(lines, autolim=False)
    for layer_index, unit_positions in enumerate(units):
        is_input_layer = layer_index == 0
        fill = ORANGE if is_input_layer else "white"
        for position in unit_positions:
            axes.add_patch(Circle(position, UNIT_RADIUS, fc=fill, ec=BLACK, lw=0.7, zorder=2))
    sizes = " - ".join(map(str, layers))
    axes.text(MIDDLE_X, center_y - 0.3, f"{name}, {sizes} units", ha="center", va="top")


def _unit_heights(n_units: int, center_y: float) -> list[float]:
    """Return the heights of the drawn units of a layer, from the top."""
    n_drawn = min(n_units, MAX_UNITS)
    distance = min(MAX_UNIT_DISTANCE, MAX_LAYER_HEIGHT / max(n_drawn - 1, 1))
    middle_index = (n_drawn - 1) / 2
    # The layers are above the center, because the name of the network needs space below.
    return [
        center_y + LAYERS_OFFSET + distance * (middle_index - unit_index)
        for unit_index in range(n_drawn)
    ]
