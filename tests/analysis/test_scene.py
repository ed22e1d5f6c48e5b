"""Images of the steps of lifetimes of several species."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from PIL import Image, ImageColor

from baldwinlab.analysis.appearance import list_symbols
from baldwinlab.analysis.movie import (
    CAPTION_HEIGHT,
    LEGEND_ROW_HEIGHT,
    Scene,
    SceneRenderer,
    write_movie,
)
from tests.analysis.results.studies import species_trace

SIZES = {"predators": 2, "prey": 3}
MAP_TOP = CAPTION_HEIGHT + LEGEND_ROW_HEIGHT


def draw_frame(trace: xr.Dataset, step: int, width: float = 640) -> Image.Image:
    return SceneRenderer(Scene(trace, width, 640)).frame(step)


def count_pixels(image: Image.Image, color: str) -> int:
    """Return the number of pixels of exactly this color."""
    return int((np.asarray(image) == ImageColor.getrgb(color)).all(axis=2).sum())


def map_at(image: Image.Image, x: float, y: float) -> tuple[int, ...]:
    """Return the color of a position of the map, which has one pixel per unit of length."""
    color = image.getpixel((round(x), round(MAP_TOP + y)))
    assert isinstance(color, tuple)
    return color


def test_each_species_has_its_color_on_the_map_and_in_the_legend() -> None:
    trace = species_trace(SIZES)
    image = draw_frame(trace, 5)
    assert image.size == (640, 640 + MAP_TOP)
    legend = image.crop((0, 0, 640, MAP_TOP - 4))
    # Only the last agent of each species has eaten.
    for symbol, agent in zip(list_symbols(trace), (1, 4), strict=True):
        color = ImageColor.getrgb(symbol.fill)
        x, y = trace["x"].values[5, agent], trace["y"].values[5, agent]
        assert map_at(image, x, y) == color
        assert map_at(image, x - 40, y) != color
        assert count_pixels(legend, symbol.fill) > 50
    # Dead agents are not drawn.
    before, after = (
        draw_frame(trace, step).crop((0, MAP_TOP, 640, 640 + MAP_TOP)) for step in (19, 39)
    )
    for symbol in list_symbols(trace):
        # The outlines of the living agents have the color, too.
        assert count_pixels(before, symbol.fill) - count_pixels(after, symbol.fill) > 50


def test_a_legend_has_rows_only_for_species() -> None:
    names = {f"species-with-a-long-name-{number}": 1 for number in range(4)}
    image = draw_frame(species_trace(names), 0)
    n_rows = (image.height - 640 - CAPTION_HEIGHT) / LEGEND_ROW_HEIGHT
    assert n_rows == 2
    # A population without species has no legend.
    single = species_trace(SIZES).drop_vars(["species", "alive"])
    assert draw_frame(single, 0).size == (640, 640 + CAPTION_HEIGHT)


def test_a_gif_has_the_exact_colors_of_the_species(tmp_path: Path) -> None:
    trace = species_trace(SIZES, steps=4)
    write_movie(trace, 640, 640, tmp_path / "life.gif")
    with Image.open(tmp_path / "life.gif") as movie:
        picture = movie.convert("RGB")
    for symbol in list_symbols(trace):
        assert count_pixels(picture, symbol.fill) > 50
