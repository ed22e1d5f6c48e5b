"""Arrange the panels of a drawn figure below each other, for narrow screens.

A figure is drawn once. The image of a page contains two layouts of the drawing: the wide layout, as
drawn, and a narrow layout with one panel per row. The styles of the page show one of them. The
image is an element of the page, so its text has the font of the page.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend

POINTS_PER_INCH: Final = 72
# Distances in points: between panels, and from a panel to the end of a label on the right.
GAP: Final = 4.0
RIGHT_MARGIN: Final = 14.0
# The label of the axes of a color bar that Matplotlib adds to a panel.
COLOR_BAR: Final = "<colorbar>"
# Two panels are in one row if their upper edges differ by fewer points.
ROW_TOLERANCE: Final = 6.0
# Height of a line of text, and width of the symbol of a legend with its gap, in font sizes.
LINE_HEIGHT: Final = 1.3
SYMBOL_WIDTH: Final = 2.9
# Smallest width of the narrow layout, in points, so that its text is not larger than page text.
MIN_NARROW_WIDTH: Final = 220.0
# Mean width of a letter, in font sizes.
LETTER_WIDTH: Final = 0.5
# A narrow layout must have at most this multiple of the width by height of the wide layout.
MAX_SHAPE_RATIO: Final = 0.9
# Smallest scale of a panel in a narrow layout. With smaller text, a narrow screen shows the wide
# layout, and scrolls it.
MIN_SCALE: Final = 0.75
# The start of an identifier or of a reference to one.
IDENTIFIER: Final = re.compile(r'(?<= id=")|(?<= xlink:href="#)|(?<=url\(#)')


class Box(NamedTuple):
    """A rectangle of the drawing, in points from the upper left corner."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def width(self) -> float:
        """Width in points."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height in points."""
        return self.bottom - self.top


class Piece(NamedTuple):
    """A rectangle of the drawing, and the position to which a layout copies the rectangle."""

    # Identifier of an SVG group.
    group: str
    source: Box  # Rectangle in the drawing.
    left: float  # Position in points: in a panel, or after `_stack`, in the narrow layout.
    top: float
    scale: float = 1.0


class NarrowLayout(NamedTuple):
    """The narrow layout of a figure, in points."""

    pieces: Sequence[Piece]
    width: float
    height: float


def name_groups(figure: Figure) -> None:
    """Name the panels and legends of a figure, before it is drawn as SVG."""
    for index, part in enumerate((*figure.axes, *figure.legends)):
        part.set_gid(f"part-{index}")


def arrange_panels(figure: Figure) -> NarrowLayout | None:
    """Return the narrow layout of a figure that was just drawn, or None if it is of no use."""
    width, height = figure.get_size_inches() * POINTS_PER_INCH
    rows = _group_rows(figure)
    columns = max(map(len, rows), default=0)
    if columns < 2:
        return None
    panels = list(_locate_panels(figure, rows))
    # The widths of the panels in complete rows. `_stack` scales wider panels down.
    row_widths = [_measure(pieces)[0] for row in panels if len(row) == columns for pieces in row]
    narrow_width = max(MIN_NARROW_WIDTH, *row_widths)
    arranged = list(_stack(figure, panels, narrow_width))
    narrow_height = max(piece.top + piece.scale * piece.source.height for piece in arranged)
    if narrow_width / narrow_height > MAX_SHAPE_RATIO * width / height:
        return None
    if min(piece.scale for piece in arranged) < MIN_SCALE:
        return None
    return NarrowLayout(arranged, narrow_width, narrow_height)


def _group_rows(figure: Figure) -> list[list[Axes]]:
    """Return the panels by row, from the left. A color bar next to a panel belongs to the panel."""
    panels = [axes for axes in figure.axes if axes.get_label() != COLOR_BAR]
    rows: list[list[Axes]] = []
    for axes in sorted(panels, key=lambda axes: -axes.get_position().y1):
        if rows and abs(locate_panel(rows[-1][0]).top - locate_panel(axes).top) < ROW_TOLERANCE:
            rows[-1].append(axes)
        else:
            rows.append([axes])
    return [sorted(row, key=lambda axes: axes.get_position().x0) for row in rows]


def locate_panel(axes: Axes) -> Box:
    """Return the rectangle of a panel between its axes, without labels."""
    figure = axes.figure
    assert isinstance(figure, Figure)
    width, height = figure.get_size_inches() * POINTS_PER_INCH
    position = axes.get_position()
    return Box(
        width * position.x0,
        height * (1 - position.y1),
        width * position.x1,
        height * (1 - position.y0),
    )


def _locate_panels(figure: Figure, rows: Sequence[Sequence[Axes]]) -> Iterator[list[list[Piece]]]:
    """Yield for each row the pieces of each panel: the panel, and labels that panels share."""
    _, height = figure.get_size_inches() * POINTS_PER_INCH
    upper, lower = _find_margins(figure)
    # The upper end of each row, and the lower end of the last row.
    tops = [upper, *(min(_find_top(axes) for axes in row) for row in rows[1:]), height - lower]
    for row, (top, bottom) in zip(rows, pairwise(tops), strict=True):
        lefts = [_find_left(axes) for axes in row]
        rights = [*lefts[1:], _find_right(figure, row)]
        if len(row) == 1:
            # The label of a short axis, such as a color bar, can be longer than the axis.
            label_left, label_right = _estimate_label(row[0])
            lefts = [max(0.0, min(lefts[0], label_left))]
            rights = [max(rights[0], label_right)]
        yield [
            _add_shared_labels(
                Piece(_name(axes), Box(left, top, right, bottom), 0, 0),
                axes,
                _find_labels_left(row[0], lefts[0], top),
                _find_labels_below(axes, rows, left, right, height - lower),
            )
            for axes, left, right in zip(row, lefts, rights, strict=True)
        ]


def _name(axes: Axes) -> str:
    return str(axes.get_gid())


def _find_labels_left(axes: Axes, left: float, top: float) -> Piece:
    """Return the labels of a vertical axis, without the ticks and the labels below the axis."""
    box = locate_panel(axes)
    return Piece(_name(axes), Box(left, top, box.left - GAP, box.bottom + GAP), 0, 0)


def _find_labels_below(
    axes: Axes, rows: Sequence[Sequence[Axes]], left: float, right: float, bottom: float
) -> Piece:
    """Return the labels of the lowest panel in the column of a panel."""
    lowest = [row[-1] for row in rows]
    for row in rows:
        lowest += [panel for panel in row if locate_panel(panel).left == locate_panel(axes).left]
    return Piece(_name(lowest[-1]), Box(left, locate_panel(lowest[-1]).bottom, right, bottom), 0, 0)


def _add_shared_labels(panel: Piece, axes: Axes, left: Piece, below: Piece) -> list[Piece]:
    """Return the pieces of a panel, with the labels that are drawn only at another panel."""
    pieces = [panel]
    if not axes.yaxis.get_tick_params().get("labelleft", True):
        pieces = [left, panel._replace(left=left.source.width)]
    if not axes.xaxis.get_tick_params().get("labelbottom", True):
        pieces.append(below._replace(left=pieces[-1].left, top=panel.source.height))
    return pieces


def _measure(pieces: Sequence[Piece]) -> tuple[float, float]:
    """Return the width and the height of a panel from its pieces, in points."""
    return (
        max(piece.left + piece.source.width for piece in pieces),
        max(piece.top + piece.source.height for piece in pieces),
    )


def _find_margins(figure: Figure) -> tuple[float, float]:
    """Return the heights of the legends above and below the panels."""
    _, height = figure.get_size_inches() * POINTS_PER_INCH
    upper = lower = 0.0
    for legend in figure.legends:
        entries = _locate_entries(figure, legend)
        if not entries:
            continue
        if entries[0].top < height / 2:
            upper = max(upper, max(entry.bottom for entry in entries) + GAP)
        else:
            lower = max(lower, height - min(entry.top for entry in entries) + GAP)
    return upper, lower


def _find_top(axes: Axes) -> float:
    title = axes.get_title(loc="left") or axes.get_title()
    lines = title.count("\n") + 1 if title else 0
    size = float(axes.title.get_fontsize())
    return locate_panel(axes).top - GAP - lines * LINE_HEIGHT * size


def _find_left(axes: Axes) -> float:
    """Return the left end of the labels of the vertical axis."""
    if not (axes.axison and axes.yaxis.get_visible()):
        return max(0.0, locate_panel(axes).left - GAP)
    label = axes.yaxis.label
    # The position of the label follows from the drawn tick labels, in points.
    position = float(label.get_position()[0])
    lines = label.get_text().count("\n") + 1 if label.get_text() else 0
    return max(0.0, position - lines * LINE_HEIGHT * float(label.get_fontsize()))


def _find_right(figure: Figure, row: Sequence[Axes]) -> float:
    """Return the right end of a row of panels, including labels or a color bar on the right."""
    width, _ = figure.get_size_inches() * POINTS_PER_INCH
    end = locate_panel(row[-1]).right
    scale = POINTS_PER_INCH / figure.dpi
    labels = [scale * text.get_window_extent().x1 for text in row[-1].texts]
    color_bars = [axes for axes in figure.axes if axes.get_label() == COLOR_BAR]
    has_color_bar = any(locate_panel(axes).left >= end for axes in color_bars)
    return float(width if has_color_bar else min(width, max([end + RIGHT_MARGIN, *labels])))


def _estimate_label(axes: Axes) -> tuple[float, float]:
    """Estimate the left and the right end of the label below a panel."""
    label = axes.xaxis.label
    box = locate_panel(axes)
    center = (box.left + box.right) / 2
    half_width = len(label.get_text()) * LETTER_WIDTH * float(label.get_fontsize()) / 2
    return center - half_width, center + half_width


def _locate_entries(figure: Figure, legend: Legend) -> list[Box]:
    """Return the entries of a legend, each with its symbol."""
    _, height = figure.get_size_inches() * POINTS_PER_INCH
    boxes = []
    for text in legend.get_texts():
        extent = text.get_window_extent(dpi=POINTS_PER_INCH)
        symbol = SYMBOL_WIDTH * float(text.get_fontsize())
        boxes.append(
            Box(extent.x0 - symbol, height - extent.y1 - 2, extent.x1 + 2, height - extent.y0 + 2)
        )
    return boxes


def _stack(
    figure: Figure, panels: Sequence[Sequence[Sequence[Piece]]], width: float
) -> Iterator[Piece]:
    """Yield the legends and the panels, one below another."""
    top = GAP
    for legend in figure.legends:
        left = line_height = 0.0
        for entry in _locate_entries(figure, legend):
            if left and left + entry.width > width:
                left, top, line_height = 0.0, top + line_height, 0.0
            yield Piece(str(legend.get_gid()), entry, left, top, min(1.0, width / entry.width))
            left += entry.width + 2 * GAP
            line_height = max(line_height, entry.height)
        top += line_height + GAP
    for pieces in (pieces for row in panels for pieces in row):
        panel_width, panel_height = _measure(pieces)
        scale = min(1.0, width / panel_width)
        for piece in pieces:
            yield piece._replace(left=scale * piece.left, top=top + scale * piece.top, scale=scale)
        top += scale * panel_height + GAP


def merge_layouts(svg: str, figure: Figure, layout: NarrowLayout) -> str:
    """Return an SVG element with both layouts, whose classes are `wide` and `narrow`."""
    width, height = figure.get_size_inches() * POINTS_PER_INCH
    start = svg.index(">", svg.index("<svg")) + 1
    drawing = svg[start : svg.rindex("</svg>")]
    parts = "".join(map(_format_piece, layout.pieces))
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink">'
        f"<defs>{drawing}</defs>"
        f'<svg class="wide" viewBox="0 0 {width:g} {height:g}">'
        '<use xlink:href="#figure_1"/></svg>'
        f'<svg class="narrow" viewBox="0 0 {layout.width:.1f} {layout.height:.1f}">{parts}</svg>'
        "</svg>"
    )


def rename_identifiers(svg: str, name: str) -> str:
    """Return an SVG element whose identifiers begin with a name, so that a page has each once."""
    return IDENTIFIER.sub(f"{name}-", svg)


def _format_piece(piece: Piece) -> str:
    source = piece.source
    return (
        f'<svg x="{piece.left:.1f}" y="{piece.top:.1f}" '
        f'width="{piece.scale * source.width:.1f}" height="{piece.scale * source.height:.1f}" '
        f'viewBox="{source.left:.1f} {source.top:.1f} {source.width:.1f} {source.height:.1f}">'
        f'<use xlink:href="#{piece.group}"/></svg>'
    )
