"""Logarithmic axes: their ticks are numbers in one size, and their labels do not overlap."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.curves import format_tick, use_log_scale
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, styled, to_svg


@styled
def draw_axis(values: list[float], linear_limit: float | None, columns: int) -> Figure:
    figure = Figure((FIGURE_WIDTH, 2))
    for axes in figure.subplots(1, columns, squeeze=False).flat:
        axes.plot(values, np.arange(len(values)), "o")
        use_log_scale(axes, linear_limit)
    return figure


@pytest.mark.parametrize("columns", [1, 2, 3])
@pytest.mark.parametrize(
    ("values", "linear_limit"),
    [
        ([0.001, 0.1], None),
        ([1, 1e7], None),
        ([1e-9, 1e13], None),
        ([20, 150], None),
        ([1000, 1300], None),
        ([50_000, 3_000_000], None),
        ([0, 1e-4, 1], 1e-4),
        ([-300, 0.1, 900], 1.0),
    ],
)
def test_a_log_axis_has_labels_that_neither_overlap_nor_have_exponents(
    values: list[float], linear_limit: float | None, columns: int
) -> None:
    figure = draw_axis(values, linear_limit, columns)
    assert b"<tspan" not in to_svg(figure)
    for axes in figure.axes:
        labels = [label for label in axes.get_xticklabels(which="both") if label.get_text()]
        assert len(labels) >= 2
        boxes = sorted((label.get_window_extent() for label in labels), key=lambda box: box.x0)
        assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


def test_powers_of_ten_have_labels_if_they_fit() -> None:
    axes = draw_axis([0.001, 1000], None, 1).axes[0]
    texts = [label.get_text() for label in axes.get_xticklabels()]
    assert texts == ["0.001", "0.01", "0.1", "1", "10", "100", "1,000"]


def test_an_axis_with_zero_has_both_signs() -> None:
    axes = draw_axis([-30, 0.5, 30], 1.0, 1).axes[0]
    texts = [label.get_text() for label in axes.get_xticklabels()]
    assert texts == ["−10", "−1", "0", "1", "10"]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0001, "0.0001"), (1e-5, "1e−5"), (999_999, "999,999"), (1e6, "1 million"),
     (2.5e6, "2.5 million"), (1e12, "1,000 billion"), (0, "0"), (-10, "−10")],
)  # fmt: skip
def test_ticks_have_all_digits_or_a_short_form(value: float, text: str) -> None:
    assert format_tick(value) == text
