"""Colours are written in one place, from which everybody takes theirs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab.analysis.figures import palette
from baldwinlab.lab.single_page import STATIC

PACKAGE = Path(baldwinlab.__file__).parent
COLOUR = re.compile(r"#(?:[0-9a-fA-F]{3}){1,2}\b(?![\w-])")


def drawing() -> list[Path]:
    """All that may draw: the package's own code and pages."""
    own = [path for end in ("py", "html", "css", "js") for path in PACKAGE.rglob(f"*.{end}")]
    return [
        path for path in own if path != PACKAGE / "palette.py" and path.parent != STATIC / "vendor"
    ]


@pytest.mark.parametrize("path", drawing(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_nobody_else_writes_a_colour(path: Path) -> None:
    assert not COLOUR.findall(path.read_text("utf-8"))


def test_every_colour_that_the_page_asks_for_is_there() -> None:
    there = set(re.findall(r"--([\w-]+):", palette.lab_css()))
    own = set(
        re.findall(
            r"--([\w-]+):", "".join(path.read_text("utf-8") for path in STATIC.glob("*.css"))
        )
    )
    for path in [*STATIC.glob("*.css"), *STATIC.glob("*.js")]:
        text = path.read_text("utf-8")
        asked = set(re.findall(r"var\(--([\w-]+)\)", text)) | set(
            re.findall(r"\bpalette\.(\w+)", text)
        ) - {"py"}
        assert asked <= there | own | {"css", "js", "text"}, path.name


def test_a_colour_has_a_shade_by_name_and_one_that_is_none_is_an_error() -> None:
    assert palette.shade("green") == palette.GREEN
    assert palette.shade("#123456") == "#123456"
    with pytest.raises(KeyError):
        palette.shade("greenish")
