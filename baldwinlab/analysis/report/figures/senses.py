"""An agent, the sectors of its senses, and an item."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle, Wedge

from baldwinlab.analysis.figures.style import BLACK, BLUE, GRAY, ORANGE, PALE, styled
from baldwinlab.analysis.figures.world import Appearance
from baldwinlab.analysis.palette import resolve_color
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.figures.maps import BODY_SIDE
from baldwinlab.analysis.report.sections import ReportFigure

# Sectors up to this angle, in degrees, have no labels at the edges, for lack of space.
MIN_LABELED_DEGREES = 10


def draw_figure(report: ReportData) -> ReportFigure | None:
    """Draw the sectors of the senses, or return None without appearances."""
    if not report.appearances:
        return None
    name, appearance = next(iter(report.appearances.items()))
    sectors = group_sectors(appearance)
    ranges = [
        f"{' and '.join(inputs)} from {sector.first_degrees:g} to {sector.last_degrees:g} degrees, "
        f"to {sector.radius:g} units"
        for sector, inputs in sectors.items()
    ]
    without_sector = [
        sensor
        for sensor, sector in zip(appearance["inputs"], appearance["sectors"], strict=True)
        if not sector
    ]
    unseen = f" Inputs without a sector: {', '.join(without_sector)}." if without_sector else ""
    last_inputs = " and ".join([*sectors.values()][-1]) if sectors else ""
    item = f" The item is in the sector of {last_inputs}." if sectors else ""
    return ReportFigure(
        title="The agents' senses",
        caption=(
            f"Sectors in which the inputs sense items, to scale, for {name}. The agent heads to "
            f"the right of the page, and its right hand is below.{item}{unseen}"
        ),
        alternative=(
            f"An agent and its sectors, clockwise from its heading: {'; '.join(ranges) or 'none'}."
        ),
        figure=draw_agent_senses(appearance),
        table=_tabulate_sectors(sectors),
    )


def _tabulate_sectors(sectors: Mapping[SensorSector, Sequence[str]]) -> list[dict[str, Any]]:
    """Return the sectors of senses: one row per input."""
    return [
        {"input": name, **sector._asdict()} for sector, names in sectors.items() for name in names
    ]


class SensorSector(NamedTuple):
    """A sector in which an input senses items."""

    # Angles of the edges, in degrees clockwise from the heading.
    first_degrees: float
    last_degrees: float
    radius: float  # Radius, in map units.

    @property
    def middle_degrees(self) -> float:
        """The angle of the middle, in degrees clockwise from the heading."""
        return self.first_degrees + self.width_degrees / 2

    @property
    def width_degrees(self) -> float:
        """The angle between the edges, in degrees."""
        return (self.last_degrees - self.first_degrees) % 360


def group_sectors(appearance: Appearance) -> dict[SensorSector, list[str]]:
    """Return the names of the inputs of each sector."""
    input_names: dict[SensorSector, list[str]] = {}
    for name, edges in zip(appearance["inputs"], appearance["sectors"], strict=True):
        if edges:
            sector = SensorSector(edges["from_degrees"], edges["to_degrees"], edges["radius"])
            input_names.setdefault(sector, []).append(name)
    return input_names


@styled
def draw_agent_senses(appearance: Appearance) -> Figure:
    """Draw an agent that heads right, its sensor sectors, and an item in the last sector."""
    sectors = group_sectors(appearance)
    radius = max((sector.radius for sector in sectors), default=4 * BODY_SIDE)
    figure = Figure((3.6, 3.1))
    axes = figure.subplots()
    _draw_sectors(axes, sectors, radius)
    axes.add_patch(Circle((0, 0), radius, fill=False, ec=GRAY, ls="--", lw=1))
    text = f"sees to {radius:g} units" if sectors else "has no sensor sector"
    axes.text(0, -1.05 * radius, text, ha="center", va="bottom", color=GRAY)
    axes.annotate("", (0.45 * radius, 0), (0, 0), arrowprops={"arrowstyle": "->", "color": BLACK})
    _draw_body(axes, 0.0, 0.0, BLUE)
    axes.text(-BODY_SIDE / 2, BODY_SIDE / 2, "agent ", ha="right", va="top")
    if sectors:
        last_sector = list(sectors)[-1]
        _draw_item(axes, last_sector, appearance)
    limit = 1.2 * max(radius, 0.8 * BODY_SIDE)
    axes.set(xlim=(-0.9 * limit, 1.2 * limit), ylim=(limit, -limit), aspect="equal")
    axes.axis("off")
    return figure


def _draw_item(axes: Axes, sector: SensorSector, appearance: Appearance) -> None:
    """Draw an item of the last kind in a sector."""
    x, y = _point_on_circle(0.78 * sector.radius, sector.middle_degrees)
    kinds = appearance["item_kinds"]
    color = resolve_color(kinds[-1]["color"]) if kinds else GRAY
    _draw_body(axes, x, y, color)
    axes.text(x, y + 0.55 * BODY_SIDE, "item", ha="center", va="top")


def _draw_sectors(axes: Axes, sectors: Mapping[SensorSector, list[str]], radius: float) -> None:
    last_sector = list(sectors)[-1] if sectors else None
    for sector, names in sectors.items():
        # The last sector contains the item and has the color of an active input in the lab.
        color = ORANGE if sector == last_sector else PALE
        edges = (sector.first_degrees, sector.last_degrees)
        axes.add_patch(Wedge((0, 0), sector.radius, *edges, fc=color, alpha=0.55, ec=GRAY, lw=1))
        x, y = _point_on_circle(1.06 * radius, sector.middle_degrees)
        axes.text(x, y, "\n".join(names), ha="left", va="center", fontweight="bold")
    wide_sectors = [sector for sector in sectors if sector.width_degrees > MIN_LABELED_DEGREES]
    edges_degrees = dict.fromkeys(
        degrees
        for sector in wide_sectors
        for degrees in (sector.first_degrees, sector.last_degrees)
    )
    for degrees in edges_degrees:
        x, y = _point_on_circle(1.1 * radius, degrees)
        # The angle between the edge and the heading, 0 to 180.
        degrees_from_heading = abs((degrees + 180) % 360 - 180)
        label = f"{degrees_from_heading:g}°"
        axes.text(x, y, label, ha="center", va="center", color=GRAY)


def _point_on_circle(radius: float, degrees: float) -> tuple[float, float]:
    radians = np.radians(degrees)
    return radius * float(np.cos(radians)), radius * float(np.sin(radians))


def _draw_body(axes: Axes, x: float, y: float, color: str) -> None:
    corner = (x - BODY_SIDE / 2, y - BODY_SIDE / 2)
    axes.add_patch(Rectangle(corner, BODY_SIDE, BODY_SIDE, fill=False, ec=color, lw=1.6))
    axes.plot(x, y, "o", color=color, ms=4)
