"""The narrow layout of figures, against the extents that Matplotlib measures."""

from __future__ import annotations

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from baldwinlab.analysis.figures import panels
from baldwinlab.analysis.figures.style import styled, to_svg
from baldwinlab.analysis.report.figures.fitness import draw_fitness_curves
from tests.analysis.results.studies import AS_THE_PAPER, study


@styled
def draw_grid(rows: int, columns: int, *, shared: bool = False) -> Figure:
    figure = Figure((7.2, 2.4 * rows))
    grid = figure.subplots(rows, columns, squeeze=False, sharex=shared, sharey=shared)
    for number, axes in enumerate(grid.flat):
        (line,) = axes.plot(np.arange(5), np.arange(5) * 10.0**number, label="a curve")
        axes.set(title=f"Panel {number}", xlabel="generation", ylabel="fitness")
    figure.legend(handles=[line], loc="outside upper center")
    return figure


def arrange(figure: Figure) -> panels.NarrowLayout | None:
    panels.name_groups(figure)
    to_svg(figure)
    return panels.arrange_panels(figure)


@pytest.mark.parametrize(
    "figure",
    # The lines of the last figure have labels at their ends.
    [draw_grid(2, 2), draw_grid(1, 3), draw_fitness_curves(study(AS_THE_PAPER))],
)
def test_a_panel_contains_what_matplotlib_measures_and_no_other_panel(figure: Figure) -> None:
    layout = arrange(figure)
    assert layout is not None
    height = figure.get_size_inches()[1] * panels.POINTS_PER_INCH
    figure.set_dpi(panels.POINTS_PER_INCH)
    for axes in figure.axes:
        (piece,) = [piece for piece in layout.pieces if piece.group == axes.get_gid()]
        extent = axes.get_tightbbox()
        assert extent is not None
        assert piece.source.left <= extent.x0 + 1 and extent.x1 <= piece.source.right + 1
        assert piece.source.top <= height - extent.y1 + 1
        assert height - extent.y0 <= piece.source.bottom + 1


def test_legends_and_shared_labels_are_arranged() -> None:
    figure = draw_grid(2, 2)
    figure.legend(handles=[], loc="outside lower center")
    layout = arrange(figure)
    assert layout is not None and len(layout.pieces) == 5
    # Shared labels are repeated in each panel.
    layout = arrange(draw_grid(2, 2, shared=True))
    assert layout is not None
    # The legend, four panels, two vertical axes and two horizontal axes.
    assert len(layout.pieces) == 1 + 4 + 2 + 2
    # A single column has no narrow layout.
    assert arrange(draw_grid(3, 1)) is None


def test_panels_are_below_each_other_in_the_order_of_reading() -> None:
    figure = draw_grid(2, 2)
    layout = arrange(figure)
    assert layout is not None
    by_group = {piece.group: piece.top for piece in layout.pieces}
    tops = [by_group[str(axes.get_gid())] for axes in figure.axes]
    assert tops == sorted(tops) and len(set(tops)) == 4
    assert layout.width < figure.get_size_inches()[0] * panels.POINTS_PER_INCH * 0.6


def test_the_image_has_one_drawing_and_both_layouts() -> None:
    figure = draw_fitness_curves(study(AS_THE_PAPER))
    layout = arrange(figure)
    assert layout is not None
    image = panels.merge_layouts(to_svg(figure).decode(), figure, layout)
    assert image.count('id="figure_1"') == 1
    references = re.findall(r'xlink:href="#(part-\d+)"', image)
    assert len(references) == len(layout.pieces)
    assert all(f'id="{name}"' in image for name in references)
