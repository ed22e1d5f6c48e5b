"""Figures of a page in a browser: the size and the font of their text, and their colors."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from baldwinlab.analysis import palette
from baldwinlab.analysis.report.figures.fitness import (
    draw_fitness_by_evaluations,
    draw_fitness_curves,
)
from baldwinlab.analysis.report.sections import (
    ReportFigure,
    Section,
    render,
    save_and_inline,
    write_page,
)
from baldwinlab.analysis.sweeps.analysis import compute_finals
from baldwinlab.analysis.sweeps.figures import draw_heat_maps
from tests.analysis.results.studies import AS_THE_PAPER, study
from tests.analysis.sweeps.made import grid
from tests.text_sizes import find_small_texts, has_bundled_font


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a page with a figure of four panels, a figure of cells, and a logarithmic axis."""
    folder = tmp_path_factory.mktemp("page")
    heat_map = draw_heat_maps(compute_finals(grid()), "learning.rate", "world.food.0.count")
    used = study({"guessing": [1, 2]}).assign(used=lambda data: 1000 * data["energy"])
    figures = {
        "fitness": draw_fitness_curves(study(AS_THE_PAPER)),
        "cells": heat_map,
        "clocks": draw_fitness_by_evaluations(used, "used"),
    }
    sections = [
        Section(name, "A figure", render("atlas/laws.html", figure=save_and_inline(drawn, folder)))
        for name, figure in figures.items()
        for drawn in [ReportFigure("A title", "A caption.", f"The {name}", figure, name=name)]
    ]
    return write_page("A page", "An answer.", sections, folder / "page.html", folder)


@pytest.mark.parametrize("width", [1280, 390])
def test_no_text_of_a_page_is_too_small_on_a_screen(
    browser: Browser, page: Path, width: int
) -> None:
    with browser.new_context(viewport={"width": width, "height": 800}) as context:
        opened = context.new_page()
        opened.goto(page.as_uri())
        opened.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
        assert find_small_texts(opened) == []
        assert has_bundled_font(opened)
        # A wide figure scrolls in its frame.
        assert opened.evaluate("document.documentElement.scrollWidth") == width
        layouts = {1280: "wide", 390: "narrow"}
        expect(opened.locator("#figure-fitness .image > svg > svg:visible")).to_have_class(
            layouts[width]
        )


@pytest.mark.parametrize(
    "small",
    ['<tspan style="font: 6.3px sans-serif">3</tspan>', '<tspan font-size="6.3">3</tspan>'],
)
def test_the_measurement_finds_small_parts_of_texts(browser: Browser, small: str) -> None:
    texts = f'<text>10{small}</text><g transform="translate(9 9) scale(0.7)"><text>4</text></g>'
    drawing = f'<svg><defs><g id="drawing" font-size="11">{texts}</g></defs>'
    with browser.new_context() as context:
        opened = context.new_page()
        opened.set_content(f'{drawing}<svg><use href="#drawing"/></svg></svg>')
        assert find_small_texts(opened) == ["6.3 px: 3", "7.7 px: 4"]


def test_a_figure_of_a_dark_page_is_dark(browser: Browser, page: Path) -> None:
    with browser.new_context(color_scheme="dark") as context:
        opened = context.new_page()
        opened.goto(page.as_uri())
        colors = opened.evaluate(
            "[['#fitness-part-0 text', 'fill'], ['.image', 'backgroundColor']].map("
            "([selector, name]) => getComputedStyle(document.querySelector(selector))[name])"
        )
    hexadecimal = [palette.REPORT_COLORS[name][1] for name in ("text", "figure")]
    as_numbers = [
        [int(color[start : start + 2], 16) for start in (1, 3, 5)] for color in hexadecimal
    ]
    assert colors == [f"rgb({', '.join(map(str, numbers))})" for numbers in as_numbers]
