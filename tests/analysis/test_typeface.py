"""The bundled fonts have all characters that the package shows, and figures use the fonts."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from fontTools.ttLib import TTFont
from matplotlib.font_manager import FontProperties, findfont

import baldwinlab
from baldwinlab.analysis import typeface
from baldwinlab.analysis.figures.style import styled

PACKAGE = Path(baldwinlab.__file__).parent
# Files with texts of pages and figures.
SUFFIXES = (".css", ".html", ".js", ".md", ".py", ".toml")
# Characters of terminals and worksheets.
OTHERS = set("─▁▂▃▄▅▆▇█☐")


@pytest.mark.parametrize("name", typeface.CSS_WEIGHTS)
def test_a_font_has_all_characters_of_the_texts(name: str) -> None:
    files = [path for path in PACKAGE.rglob("*") if path.suffix in SUFFIXES]
    used = {letter for path in files for letter in path.read_text("utf-8") if ord(letter) >= 0x80}
    assert len(used) > 20
    for suffix in ("ttf", "woff"):
        characters = map(chr, TTFont(typeface.FOLDER / f"{name}.{suffix}").getBestCmap())
        assert used - OTHERS <= set(characters)


@pytest.mark.parametrize(
    ("weight", "name"), [("normal", "Inter-Regular"), ("bold", "Inter-SemiBold")]
)
def test_figures_use_the_fonts_without_a_warning(
    weight: str, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, "matplotlib"):
        path = styled(lambda: findfont(FontProperties(weight=weight)))()
    assert Path(path) == typeface.FOLDER / f"{name}.ttf"
    assert not caplog.records


def test_the_license_is_beside_the_fonts() -> None:
    text = (typeface.FOLDER / "LICENSE.txt").read_text("utf-8")
    assert "SIL OPEN FONT LICENSE Version 1.1" in text and "The Inter Project Authors" in text
