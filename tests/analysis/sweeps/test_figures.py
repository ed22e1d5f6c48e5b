"""The figures of a sweep can be drawn of any sweep, to the same bytes each time."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.text import Text

from baldwinlab.analysis.figures.style import to_svg
from baldwinlab.analysis.sweeps.analysis import compute_finals
from baldwinlab.analysis.sweeps.figures import (
    choose_axis_scale,
    draw_heat_maps,
    draw_response_curves,
)
from baldwinlab.analysis.typeface import TEXT_SIZE
from tests.analysis.sweeps.made import grid, sample

RATE = "learning.rate"
COUNT = "world.food.0.count"

DRAW: dict[str, Callable[[], Figure]] = {
    "curves": lambda: draw_response_curves(compute_finals(grid())),
    "scatter": lambda: draw_response_curves(compute_finals(sample(30))),
    "heat maps": lambda: draw_heat_maps(compute_finals(grid()), RATE, COUNT),
}


@pytest.mark.parametrize("name", DRAW)
def test_a_figure_has_the_same_bytes_each_time_and_no_text_too_small_to_read_in_print(
    name: str,
) -> None:
    figure = DRAW[name]()
    assert to_svg(figure) == to_svg(DRAW[name]())
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text) and text.get_text()]
    assert texts and min(float(text.get_fontsize()) for text in texts) >= TEXT_SIZE
    # The exponents of mathematical text are smaller.
    assert not any("$" in text.get_text() for text in texts)
    assert figure.get_size_inches()[0] <= 7.2


@pytest.mark.parametrize(
    "data",
    [
        grid(runs=1),
        sample(1),
        sample(3),
        grid().isel({RATE: [0], COUNT: [0]}),
        grid().where(grid()[COUNT] < 50),
    ],
    ids=["one run", "one point", "three points", "one point without meals", "without a run"],
)
def test_odd_sweeps_are_drawn_without_a_warning(data: xr.Dataset) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert to_svg(draw_response_curves(compute_finals(data)))
        if data.attrs["design"] == "grid":
            assert to_svg(draw_heat_maps(compute_finals(data), RATE, COUNT))


@pytest.mark.parametrize(
    ("values", "scale"),
    [
        ([0.001, 0.01, 0.1], "log"),
        ([0, 0.001, 0.01, 0.1], "symlog"),
        ([1, 2, 5, 10, 20, 50], "log"),
        (list(range(10, 110, 10)), "linear"),
        ([0, 10, 50], "linear"),
        ([10, 50], "linear"),
        ([-1, 1, 100], "linear"),
        ([0.5], "linear"),
        ([0], "linear"),
        (10 ** np.random.default_rng(1).uniform(-4, 0, 64), "log"),
        (np.random.default_rng(1).uniform(1, 100, 64), "linear"),
    ],
)
def test_an_axis_is_logarithmic_where_the_values_are_spaced_so(
    values: list[float], scale: str
) -> None:
    assert choose_axis_scale(values) == scale


def test_heat_maps_write_the_means_into_their_cells() -> None:
    figure = draw_heat_maps(compute_finals(grid()), RATE, COUNT)
    cells = [text.get_text() for text in figure.axes[1].texts]
    assert cells == ["0", "4.5", "14", "0", "1.5", "10"]


def test_a_dollar_sign_in_a_description_begins_no_formula() -> None:
    data = grid()
    # The first one is no valid formula, and the second one is.
    data[RATE].attrs["long_name"] = "price, $\\frac{$"
    data[COUNT].attrs["long_name"] = "from $x_1$ to $y$"
    for figure in (
        draw_response_curves(compute_finals(data)),
        draw_heat_maps(compute_finals(data), RATE, COUNT),
    ):
        drawing = to_svg(figure)
        assert b"price, $\\frac{$" in drawing and b"from $x_1$ to $y$" in drawing
