"""Colors of figures, movies, the report and the page of the lab.

People with any kind of color vision can distinguish the basic colors. Some colors are lighter on a
dark background.

A color has one meaning. On a map, blue is an agent, green is food and eating, orange is the input
of an agent, plum is the selection of the reader, and purple is a teaching signal. In text, green is
good and vermilion is bad. Conditions have the colors of `SERIES_COLORS`, in the order of the study.
Lifetimes of an assay, and newborns, have other colors than the first conditions.

References
----------
M. Okabe and K. Ito, Color Universal Design (2008).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

BLUE = "#0072b2"
VERMILION = "#d55e00"
GREEN = "#009e73"
PURPLE = "#cc79a7"
ORANGE = "#e69f00"
SKY = "#56b4e9"
BLACK = "#000000"
BROWN = "#8c6239"
PLUM = "#9b2f76"
GRAY = "#666666"
DARK_GRAY = "#444444"
MID_GRAY = "#999999"
PALE = "#e4e4e4"
# Colors of text in colored cells, which a dark page does not replace.
CELL_TEXT: Final = {"black": "#010101", "white": "#fefefe"}

# Colors of conditions, in print.
SERIES_COLORS: Final = (BLUE, VERMILION, GREEN, PURPLE, BROWN, SKY, BLACK)
# Colors of conditions on a screen. Gray replaces black, which is invisible on a dark page.
SERIES_COLORS_ON_SCREEN: Final = (*SERIES_COLORS[:-1], "#8a8a8a")
# Colors of lifetimes: with learning, without learning, with frozen learned weights, with drift.
LIFE_COLORS: Final = {"on": BLACK, "off": PURPLE, "frozen": SKY, "drift": MID_GRAY}
# Colors of newborns: random genomes, then generations. Later generations are darker.
NEWBORN_COLORS: Final = (MID_GRAY, "#c8a57a", BROWN, "#4a3016")

# Colors by name, on a light and on a dark screen. Parts use these names to declare their color.
NAMED_COLORS: Final[Mapping[str, tuple[str, str]]] = {
    "blue": (BLUE, SKY),
    "vermilion": (VERMILION, "#ff8a3d"),
    "green": (GREEN, "#22b78a"),
    "purple": (PURPLE, "#e0a3c4"),
    "orange": (ORANGE, "#f0b429"),
    "sky": (SKY, "#8ccbf0"),
    "black": (BLACK, "#e7edf3"),
    "gray": (GRAY, "#9aa8b6"),
}

# Colors and shapes of species on a map, in turn. 5 colors and 4 shapes have no common divisor, so
# the first 20 species differ.
SPECIES_COLORS: Final = ("blue", "vermilion", "black", "gray", "sky")
SPECIES_SHAPES: Final = ("circle", "triangle", "square", "diamond")

# Colors by use, on a light and on a dark screen: the page of the lab.
PAGE_COLORS: Final[Mapping[str, tuple[str, str]]] = {
    "ground": ("#f4f6f8", "#0e1217"),
    "surface": ("#ffffff", "#151b22"),
    "raised": ("#ffffff", "#1b232c"),
    "sunken": ("#eceff3", "#10151b"),
    "line": ("#dde2e8", "#27313c"),
    "line-strong": ("#c3cbd5", "#3b4855"),
    "text": ("#17202a", "#e7edf3"),
    "soft": ("#55616f", "#9aa8b6"),
    "accent": (BLUE, "#3d9fd8"),
    "accent-text": ("#ffffff", "#06131c"),
    "accent-soft": ("#e3f0f8", "#16303f"),
    "link": ("#005f96", "#6dbdec"),
    # Vermilion, but dark enough for text on a light screen.
    "warm": ("#a63a00", "#ff8a3d"),
    "good": ("#00795a", "#2bc295"),
    "on-orange": ("#201600", "#201600"),
    # Words and parts of the explorable: set at birth, learned in life, wrong, never learned, and
    # poison.
    "innate": (BLUE, SKY),
    "learned": (PLUM, "#f08ac8"),
    "wrong": ("#a63a00", "#ff8a3d"),
    "control": (GRAY, "#9aa8b6"),
    "poison": (BROWN, "#c8a57a"),
    "notice": ("#ffe9b3", "#4d3c10"),
}

# Colors of the map in the lab, by use, on a light and on a dark screen.
WORLD_COLORS: Final[Mapping[str, tuple[str, str]]] = {
    "around": ("#eceff3", "#0b0f13"),  # Outside the map.
    "map": ("#ffffff", "#141b22"),
    "grid": ("#eef1f4", "#1a222b"),
    "edge": ("#c3cbd5", "#36424f"),
    "meal": NAMED_COLORS["green"],
    "agent": NAMED_COLORS["blue"],
    "hungry": ("#ffffff", "#141b22"),  # Inside of an agent that has not eaten.
    "outline": ("#56616e", "#8796a5"),
    "trail": NAMED_COLORS["blue"],
    "chosen": (PLUM, "#f08ac8"),  # Selection of the reader.
    "sight": NAMED_COLORS["blue"],
    "lit": NAMED_COLORS["orange"],  # Input that is not 0.
    "flash": ("#00795a", "#7fe3c0"),
    "lesson": NAMED_COLORS["purple"],  # Teaching signal.
    # Squares with more and more agents. The lightness changes from class to class.
    "density-1": ("#d6e6f4", "#17395a"),
    "density-2": ("#abcfe9", "#1e5080"),
    "density-3": ("#75b2dd", "#286ba8"),
    "density-4": ("#4292c6", "#3f8ccb"),
    "density-5": ("#2070b4", "#6fb0e2"),
    "density-6": ("#0a4a90", "#a6d0f0"),
    "density-7": ("#08264f", "#e6f3fd"),
}

# Background color of each verdict.
VERDICT_COLORS: Final[Mapping[str, str]] = {
    "holds": "#a9dcc8",
    "undecided": "#f3f3f3",
    "does not hold": "#f2b08a",
    "not evaluated": "#ffffff",
}

# Colors of a movie, by use.
MOVIE_COLORS: Final[Mapping[str, str]] = {
    "background": "#fbfaf7",
    "agent": BLUE,
    "hungry": "#ffffff",
    "outline": "#56616e",
    "trail": "#9cc3e0",
    "meal": "#8ac0b0",
    "line": "#c3cbd5",
    "text": DARK_GRAY,
}

# Colors of a report, by use: on a light screen, on a dark screen, and on paper.
REPORT_COLORS: Final[Mapping[str, tuple[str, str, str]]] = {
    "page": ("#fff", "#14181c", "#fff"),
    "text": ("#1d2329", "#e6eaee", "#000"),
    "soft": ("#5a646e", "#a3adb7", "#444"),
    "line": ("#d9dee3", "#37404a", "#bbb"),
    "raised": ("#f5f7f9", "#1d2329", "#fff"),
    "figure": ("#fff", "#1d2329", "#fff"),
    "good": ("#00614a", "#4fd0a9", "#00614a"),
    "bad": ("#a63a00", "#ff9a63", "#a63a00"),
    "open": ("#434b54", "#c5ced6", "#434b54"),
    "none": ("#5a646e", "#a3adb7", "#5a646e"),
    "link": ("#00568a", "#7cc4f5", "#00568a"),
    "replay": (ORANGE, "#f0b429", ORANGE),
}


def resolve_color(color: str) -> str:
    """Return "#rrggbb" for a color name on a light background. "#rrggbb" is not changed."""
    return color if color.startswith("#") else {**NAMED_COLORS, **WORLD_COLORS}[color][0]


def choose_text_color(background: Sequence[float]) -> str:
    """Return the color of text, black or white, with the higher contrast to a background.

    `background`: red, green and blue, 0 to 1. WCAG 2 defines the luminance and the contrast.
    """
    weights = (0.2126, 0.7152, 0.0722)
    luminance = sum(
        weight * (value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4)
        for weight, value in zip(weights, background, strict=True)
    )
    # Black has the higher contrast if (luminance + 0.05) / 0.05 > 1.05 / (luminance + 0.05).
    return "black" if (luminance + 0.05) ** 2 > 0.05 * 1.05 else "white"


def choose_species_style(index: int) -> tuple[str, str]:
    """Return the color name and the shape of a species on a map, such as ("blue", "circle")."""
    color = SPECIES_COLORS[index % len(SPECIES_COLORS)]
    shape = SPECIES_SHAPES[index % len(SPECIES_SHAPES)]
    return color, shape


def lab_css() -> str:
    """Return the colors of the lab as CSS variables, such as `--text`.

    The variables `--series-0` to `--series-6` are the colors of curves on light and dark screens.
    """
    shades = {**NAMED_COLORS, **PAGE_COLORS, **WORLD_COLORS}
    light = {name: on_light for name, (on_light, _) in shades.items()}
    dark = {name: on_dark for name, (_, on_dark) in shades.items()}
    series = {f"series-{number}": color for number, color in enumerate(SERIES_COLORS_ON_SCREEN)}
    dark_rule = f"@media (prefers-color-scheme: dark) {{ {_root_rule(dark)} }}"
    return f"{_root_rule(light | series)}\n{dark_rule}\n"


def report_css() -> str:
    """Return the colors of a report as CSS variables, for light and dark screens and for paper."""
    light = {name: on_light for name, (on_light, _, _) in REPORT_COLORS.items()}
    dark = {name: on_dark for name, (_, on_dark, _) in REPORT_COLORS.items()}
    paper = {name: in_print for name, (_, _, in_print) in REPORT_COLORS.items()}
    dark_rule = f"@media (prefers-color-scheme: dark) {{ {_root_rule(dark)} }}"
    paper_rule = f"@media print {{ {_root_rule(paper)} }}"
    return "\n".join((_root_rule(light), dark_rule, paper_rule))


def figure_css() -> str:
    """Return rules that replace the colors of figures on a dark screen, but not on paper.

    The figures are SVG elements of a page. Text and lines without a color of their own are black.
    Text in a colored cell keeps its color.
    """
    colors = {light: dark for light, dark in NAMED_COLORS.values() if light != dark}
    colors |= {PALE: REPORT_COLORS["line"][1], DARK_GRAY: REPORT_COLORS["soft"][1]}
    rules = [
        f'[style*="{use}: {light}"] {{ {use}: {dark} !important; }}'
        for light, dark in colors.items()
        for use in ("fill", "stroke")
    ]
    text, background = (REPORT_COLORS[name][1] for name in ("text", "figure"))
    rules += [
        f"text {{ fill: {text}; }}",
        f'path[style*="fill: #ffffff"] {{ fill: {background} !important; }}',
    ]
    return f"@media screen and (prefers-color-scheme: dark) {{ {' '.join(rules)} }}"


def _root_rule(colors: Mapping[str, str]) -> str:
    return f":root {{ {' '.join(f'--{name}: {color};' for name, color in colors.items())} }}"
