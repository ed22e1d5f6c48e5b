"""Write the fonts of the package: two weights of Inter with the characters of European languages.

    python -m scripts.fonts FOLDER

FOLDER has `Inter-Regular.otf` and `Inter-SemiBold.otf`, as in the Debian package `fonts-inter`.
Matplotlib embeds only TrueType outlines in PDF files, so the cubic outlines are approximated by
quadratic ones. Pages have the same fonts, compressed.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fontTools import subset
from fontTools.pens.cu2quPen import Cu2QuPen
from fontTools.pens.ttGlyphPen import TTGlyphPen
from fontTools.ttLib import TTFont, newTable

from baldwinlab.analysis import typeface

# Latin, Greek, dashes and quotation marks, from the first to the last code of each.
RANGES = (
    (0x20, 0x7E),
    (0xA0, 0xFF),
    (0x391, 0x3A9),
    (0x3B1, 0x3C9),
    (0x2010, 0x2015),
    (0x2018, 0x201E),
)
SYMBOLS = "…‰′″‿⁰⁴⁵⁶⁷⁸⁹⁻₀₁₂₃←↑→↓↔⇒−∂∆∏∑√∞∫≈≠≤≥▲▶▼●■◆✓✗ıŁłŒœŠšŽžẞ€"
# Copyright, names, version and license.
NAMES = [0, 1, 2, 3, 4, 5, 6, 7, 13, 14, 16, 17]
FEATURES = ["kern", "tnum"]
# Largest distance between the outlines, in units of the font. An em has 2816 units.
MAX_ERROR = 1.0
# The weight of SemiBold for Matplotlib, whose other fonts have no weight between 400 and 700.
BOLD = 700


def main(folder: Path) -> None:
    """Write each font as TrueType and as WOFF."""
    for name in typeface.CSS_WEIGHTS:
        font = TTFont(folder / f"{name}.otf", recalcTimestamp=False)
        select_characters(font)
        approximate_outlines(font)
        if font["OS/2"].usWeightClass > 400:
            font["OS/2"].usWeightClass = BOLD
        font.save(typeface.FOLDER / f"{name}.ttf")
        font.flavor = "woff"
        font.save(typeface.FOLDER / f"{name}.woff")


def select_characters(font: TTFont) -> None:
    """Remove all other characters and features."""
    codes = {code for first, last in RANGES for code in range(first, last + 1)}
    options = subset.Options(layout_features=FEATURES, name_IDs=NAMES, notdef_outline=True)
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=codes | {ord(symbol) for symbol in SYMBOLS})
    subsetter.subset(font)


def approximate_outlines(font: TTFont) -> None:
    """Replace cubic outlines by quadratic ones."""
    glyphs = {}
    for name, glyph in font.getGlyphSet().items():
        pen = TTGlyphPen(None)
        glyph.draw(Cu2QuPen(pen, MAX_ERROR, reverse_direction=True))
        glyphs[name] = pen.glyph()
    font["loca"] = newTable("loca")
    font["glyf"] = newTable("glyf")
    font["glyf"].glyphOrder = font.getGlyphOrder()
    font["glyf"].glyphs = glyphs
    del font["CFF "]
    font.sfntVersion = "\x00\x01\x00\x00"
    font["maxp"].tableVersion = 0x00010000
    # The font has no instructions, and none of its outlines consists of others.
    for limit in (
        "TwilightPoints", "Storage", "FunctionDefs", "InstructionDefs", "StackElements",
        "SizeOfInstructions", "ComponentElements",
    ):  # fmt: skip
        setattr(font["maxp"], f"max{limit}", 0)
    font["maxp"].maxZones = 1
    font["post"].formatType = 3.0  # Without the names of glyphs.


if __name__ == "__main__":
    main(Path(sys.argv[1]))
