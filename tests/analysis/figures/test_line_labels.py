"""Labels at the ends of lines: their order and space, and figures that need a legend instead."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text
from matplotlib.transforms import Bbox

from baldwinlab.analysis.figures.curves import draw_line
from baldwinlab.analysis.figures.line_labels import label_lines
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, choose_style, styled, to_svg


@styled
def draw(ends: Mapping[str, float], columns: int = 2, n_points: int = 10) -> Figure:
    """Draw lines that end at the given values. The first line has `n_points` of 10 points."""
    styles = {name: choose_style(index) for index, name in enumerate(ends)}
    figure = Figure((FIGURE_WIDTH, 2.5))
    for axes in figure.subplots(1, columns, squeeze=False).flat:
        for index, (name, end) in enumerate(ends.items()):
            x = np.arange(10 if index else n_points)
            draw_line(axes, x, np.linspace(0, end, x.size), styles[name], name)
    label_lines(figure, styles)
    to_svg(figure)
    return figure


def list_labels(axes: Axes) -> list[Annotation]:
    return [text for text in axes.texts if isinstance(text, Annotation)]


def measure(label: Annotation) -> Bbox:
    """Return the rectangle of a label, without the line from the label to the end of its curve."""
    return Text.get_window_extent(label)


@pytest.mark.parametrize(
    "ends",
    [
        {"one": 5.0},
        {"upper": 9.0, "lower": 3.0},
        {"evo": 5.0, "evo+self-taught": 5.001},
        dict.fromkeys("abcdef", 0.0),
        {"a": 0.0, "b": 0.1, "c": 9.9, "d": 10.0, "e": 10.0},
    ],
)
def test_labels_are_next_to_the_ends_in_their_order_and_do_not_overlap(
    ends: dict[str, float],
) -> None:
    figure = draw(ends)
    assert not figure.legends
    for axes in figure.axes:
        labels = list_labels(axes)
        # From the lowest. Of equal ends, the first line has the upper label.
        names = sorted(ends, key=lambda name: -ends[name])[::-1]
        assert [label.get_text().replace("\n", "") for label in labels] == names
        boxes = [measure(label) for label in labels]
        assert all(lower.y1 <= upper.y0 for lower, upper in pairwise(boxes))
        panel = axes.get_window_extent()
        for box in boxes:
            assert panel.x1 < box.x1 <= figure.bbox.x1
            assert panel.y0 - 3 <= box.y0 and box.y1 <= panel.y1 + 3


def test_a_label_without_neighbors_has_the_height_and_the_color_of_its_end() -> None:
    figure = draw({"upper": 9.0, "lower": 3.0})
    axes = figure.axes[0]
    for label, line in zip(list_labels(axes), axes.lines[::-1], strict=True):
        end = axes.transData.transform(np.asarray(line.get_xydata())[-1])
        box = measure(label)
        assert (box.y0 + box.y1) / 2 == pytest.approx(end[1], abs=3)
        assert label.arrow_patch is not None
        assert to_hex(label.arrow_patch.get_edgecolor()) == line.get_color()


def test_a_long_label_is_broken_between_its_parts() -> None:
    figure = draw({"evo+self-taught": 5.0, "agents that do not learn": 1.0})
    texts = [label.get_text() for label in list_labels(figure.axes[0])]
    assert texts == ["agents that\ndo not learn", "evo+\nself-taught"]


@pytest.mark.parametrize(
    "figure",
    [
        draw({f"rule {index}": index for index in range(7)}),
        draw({"a-rule-with-a-very-long-name": 5.0}),
        draw({"evo": 5.0, "self-taught": 1.0}, columns=3),
        draw({"ends early": 5.0, "ends late": 1.0}, n_points=6),
    ],
    ids=["many lines", "long name", "narrow panels", "early end"],
)
def test_a_figure_without_space_for_labels_has_a_legend(figure: Figure) -> None:
    assert len(figure.legends) == 1
    assert not any(list_labels(axes) for axes in figure.axes)
