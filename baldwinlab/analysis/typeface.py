"""The typeface of figures and pages: Inter, in two weights.

The folder `fonts` has the files and their license. `scripts/fonts.py` wrote the files. Matplotlib
reads TrueType files, and pages have the same fonts compressed (WOFF).
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).with_name("fonts")
FAMILY: Final = "Inter"
# The weights of CSS that each file shows.
CSS_WEIGHTS: Final[Mapping[str, str]] = {"Inter-Regular": "100 549", "Inter-SemiBold": "550 900"}
# Inter, and fonts for other characters.
CSS_FAMILIES: Final = f'"{FAMILY}", "Segoe UI", Roboto, Arial, system-ui, sans-serif'
CODE_FAMILIES: Final = (
    'ui-monospace, "SF Mono", "Cascadia Mono", Menlo, Consolas, "Liberation Mono", monospace'
)
# Text of figures, in points. On a screen, a text has at least this number of CSS pixels.
TEXT_SIZE: Final = 9.0
MIN_PIXELS: Final = 11.0


def font_css(folder: str = "") -> str:
    """Return the typeface as CSS: its files, and the variables `--font` and `--mono` of families.

    `folder`: the address of the files. Without an address, the CSS contains the files.
    """
    faces = [
        f'@font-face {{ font-family: "{FAMILY}"; font-weight: {weights}; '
        f'src: url("{_locate(f"{name}.woff", folder)}") format("woff"); }}'
        for name, weights in CSS_WEIGHTS.items()
    ]
    return "\n".join((*faces, f":root {{ --font: {CSS_FAMILIES}; --mono: {CODE_FAMILIES}; }}\n"))


def _locate(file: str, folder: str) -> str:
    if folder:
        return f"{folder}/{file}"
    return f"data:font/woff;base64,{b64encode((FOLDER / file).read_bytes()).decode()}"
