"""Appearance of traces, and symbols of species on a map, drawn and measured."""

from __future__ import annotations

import json
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr
from PIL import Image, ImageColor, ImageDraw

from baldwinlab.analysis.appearance import (
    DART,
    AgentSymbol,
    draw_agent,
    draw_shape,
    has_appearance,
    list_symbol_numbers,
    list_symbols,
    read_appearance,
)
from baldwinlab.analysis.palette import MOVIE_COLORS, SPECIES_SHAPES
from baldwinlab.experiment.species import MAX_SPECIES
from tests.analysis.results.studies import species_trace, trace

SIZE = 101
CENTER = (50.0, 50.0)


def mask_of_shape(symbol: AgentSymbol) -> npt.NDArray[np.bool_]:
    """Return whether each pixel is inside a filled shape, [row, column]."""
    image = Image.new("RGB", (SIZE, SIZE), "white")
    draw_shape(ImageDraw.Draw(image), symbol, CENTER, 30, symbol.fill, 1)
    pixels: npt.NDArray[np.uint8] = np.asarray(image)
    is_inside: npt.NDArray[np.bool_] = (pixels != 255).any(axis=2)
    return is_inside


def test_the_shapes_of_species_differ_without_color_and_have_similar_areas() -> None:
    names = [f"species-{number}" for number in range(len(SPECIES_SHAPES))]
    symbols = list_symbols(species_trace(dict.fromkeys(names, 1)))
    masks = [mask_of_shape(symbol) for symbol in symbols]
    areas = [mask.sum() for mask in masks]
    assert max(areas) < 1.35 * min(areas)
    for first, second in combinations(masks, 2):
        assert (first != second).sum() > 0.1 * min(areas)


def test_all_species_of_a_population_have_different_symbols() -> None:
    sizes = {f"species-{number}": 1 for number in range(MAX_SPECIES)}
    symbols = list_symbols(species_trace(sizes))
    assert [symbol.name for symbol in symbols] == list(sizes)
    assert len({(symbol.shape, symbol.fill) for symbol in symbols}) == MAX_SPECIES
    # Each agent has the symbol of its species.
    assert list_symbol_numbers(species_trace({"predators": 2, "prey": 3})) == [0, 0, 1, 1, 1]
    # Agents of one species are darts.
    single = trace("evo/A", 0, agents=4)
    assert list_symbols(single) == [DART]
    assert list_symbol_numbers(single) == [0] * 4


def test_no_species_has_the_color_of_food_or_of_a_meal() -> None:
    symbols = list_symbols(species_trace({f"species-{number}": 1 for number in range(8)}))
    food_colors = [ImageColor.getrgb(MOVIE_COLORS["meal"])]
    for symbol in symbols:
        color = ImageColor.getrgb(symbol.fill)
        red, green, blue = color[:3]
        assert color not in food_colors
        assert green <= max(red, blue)


@pytest.mark.parametrize("number", range(len(SPECIES_SHAPES)))
@pytest.mark.parametrize(("heading", "direction"), [(0.0, (1, 0)), (np.pi / 2, (0, 1))])
def test_a_line_from_the_shape_shows_the_heading(
    number: int, heading: float, direction: tuple[int, int]
) -> None:
    symbol = list_symbols(species_trace({"a": 1, "b": 1, "c": 1, "d": 1}))[number]
    image = Image.new("RGB", (SIZE, SIZE), "white")
    draw_agent(ImageDraw.Draw(image), symbol, CENTER, heading, 30, "white", 1)
    dx, dy = direction
    tip = (int(CENTER[0] + 42 * dx), int(CENTER[1] + 42 * dy))
    back = (int(CENTER[0] - 42 * dx), int(CENTER[1] - 42 * dy))
    assert image.getpixel(tip) == ImageColor.getrgb(symbol.outline)
    assert image.getpixel(back) == (255, 255, 255)


def test_the_appearance_is_an_attribute_of_a_trace() -> None:
    trace = xr.Dataset(attrs={"appearance": json.dumps({"inputs": ["left"]})})
    assert has_appearance(trace)
    assert read_appearance(trace) == {"inputs": ["left"]}
    assert not has_appearance(xr.Dataset())
