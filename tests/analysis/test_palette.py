"""Tests that every color of the package is defined in `palette`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from matplotlib import colormaps

import baldwinlab
from baldwinlab.analysis import palette, typeface
from baldwinlab.lab.pages.single_page import STATIC_FOLDER

PACKAGE = Path(baldwinlab.__file__).parent
COLOR = re.compile(r"#(?:[0-9a-fA-F]{3}){1,2}\b(?![\w-])")


def source_files() -> list[Path]:
    """Return the code and the pages of the package, without third-party files."""
    files = [
        path for suffix in ("py", "html", "css", "js") for path in PACKAGE.rglob(f"*.{suffix}")
    ]
    skipped = {Path(palette.__file__), *(STATIC_FOLDER / "vendor").iterdir()}
    return [path for path in files if path not in skipped]


def test_only_the_palette_defines_colors() -> None:
    colors = {
        str(path.relative_to(PACKAGE)): COLOR.findall(path.read_text("utf-8"))
        for path in source_files()
    }
    assert {path: found for path, found in colors.items() if found} == {}


def test_every_color_used_by_the_page_is_defined() -> None:
    declared = re.compile(r"--([\w-]+):")
    pages = [path for suffix in ("css", "js") for path in STATIC_FOLDER.rglob(f"*.{suffix}")]
    pages = [path for path in pages if path.parent.name != "vendor"]
    styles = "".join(path.read_text("utf-8") for path in pages if path.suffix == ".css")
    defined = set(declared.findall(typeface.font_css() + palette.lab_css() + styles))
    for path in pages:
        text = path.read_text("utf-8")
        used = set(re.findall(r"var\(--([\w-]+)\)", text))
        used |= set(re.findall(r"\bpalette\.(\w+)", text)) - {"py"}
        assert used <= defined | {"css", "js", "text"}, path.name


def test_a_color_name_has_a_shade_and_an_unknown_name_is_an_error() -> None:
    assert palette.resolve_color("green") == palette.GREEN
    assert palette.resolve_color("#123456") == "#123456"
    with pytest.raises(KeyError):
        palette.resolve_color("greenish")


@pytest.mark.parametrize("colormap", ["cividis", "Blues", "gray"])
def test_text_on_any_color_has_the_contrast_that_wcag_requires(colormap: str) -> None:
    for share in range(11):
        background = colormaps[colormap](share / 10)[:3]
        text = {"black": (0, 0, 0), "white": (1, 1, 1)}[palette.choose_text_color(background)]
        darker, lighter = sorted((measure_luminance(background), measure_luminance(text)))
        assert (lighter + 0.05) / (darker + 0.05) >= 4.5


def measure_luminance(color: Sequence[float]) -> float:
    """Return the relative luminance of WCAG 2."""
    red, green, blue = (
        value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4 for value in color
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
