"""Colours are written in one place, from which everybody takes theirs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab import palette
from baldwinlab.lab.share import STATIC

PACKAGE = Path(baldwinlab.__file__).parent
COLOUR = re.compile(r"#(?:[0-9a-fA-F]{3}){1,2}\b(?![\w-])")


DRAWING = [*STATIC.glob("*.js"), *STATIC.glob("*.css"), PACKAGE / "movie.py", PACKAGE / "figures/style.py"]


@pytest.mark.parametrize("path", DRAWING, ids=lambda path: path.name)
def test_nobody_else_writes_a_colour_of_the_page_the_movie_or_the_figures(path: Path) -> None:
    found = [colour for colour in COLOUR.findall(path.read_text("utf-8")) if colour not in ("#e4e4e4",)]  # the grid of figures
    assert not found


def test_every_colour_that_the_page_asks_for_is_there() -> None:
    there = set(re.findall(r"--([\w-]+):", palette.lab_css()))
    own = set(re.findall(r"--([\w-]+):", "".join(path.read_text("utf-8") for path in STATIC.glob("*.css"))))
    for path in [*STATIC.glob("*.css"), *STATIC.glob("*.js")]:
        text = path.read_text("utf-8")
        asked = set(re.findall(r"var\(--([\w-]+)\)", text)) | set(re.findall(r"\bpalette\.(\w+)", text)) - {"py"}
        assert asked <= there | own | {"css", "js", "text"}, path.name


def test_a_colour_has_a_shade_by_name_and_one_that_is_none_is_an_error() -> None:
    assert palette.shade("green") == palette.GREEN
    assert palette.shade("#123456") == "#123456"
    with pytest.raises(KeyError):
        palette.shade("greenish")
