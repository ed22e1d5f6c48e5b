"""Every colour of the house, once: figures, movies, the report and the page of the lab take theirs from here.

M. Okabe and K. Ito, Color Universal Design (2008): told apart with every kind of colour vision. On dark ground some are lighter.

A colour says one thing. In a world, drawn on whatever: blue is an agent, green is food and eating it, orange is what an agent
senses, plum is what the reader has chosen, purple a lesson. In words: green is well, vermilion is not. Conditions are told apart
by the colours of `SERIES`, in the order of the study; what an agent does in another life, and newborns, by colours that the first
conditions lack.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#cc79a7",
    "#e69f00",
    "#56b4e9",
    "#000000",
)
BROWN, PLUM = "#8c6239", "#9b2f76"
GRAY, DARK_GRAY, MID_GRAY, PALE = "#666666", "#444444", "#999999", "#e4e4e4"

SERIES: Final = (BLUE, VERMILION, GREEN, PURPLE, BROWN, SKY, BLACK)  # of conditions, in print
SERIES_ON_SCREEN: Final = (*SERIES[:6], "#8a8a8a")  # black does not show on a dark page
LIVES: Final = {
    "on": BLACK,
    "off": PURPLE,
    "frozen": SKY,
    "drift": MID_GRAY,
}  # of the same newborns
NEWBORNS: Final = (
    MID_GRAY,
    "#c8a57a",
    BROWN,
    "#4a3016",
)  # random genomes, then generations, the later the darker

# By name: on a light screen, and on a dark one. A part of the world says by these in which colour it is drawn.
NAMED: Final[Mapping[str, tuple[str, str]]] = {
    "blue": (BLUE, SKY),
    "vermilion": (VERMILION, "#ff8a3d"),
    "green": (GREEN, "#22b78a"),
    "purple": (PURPLE, "#e0a3c4"),
    "orange": (ORANGE, "#f0b429"),
    "sky": (SKY, "#8ccbf0"),
    "black": (BLACK, "#e7edf3"),
    "grey": (GRAY, "#9aa8b6"),
}

# By what they are for: on the page of the lab ...
PAGE: Final[Mapping[str, tuple[str, str]]] = {
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
    "warm": ("#a63a00", "#ff8a3d"),  # as vermilion, but dark enough for words on a light screen
    "good": ("#00795a", "#2bc295"),
    "on-orange": ("#201600", "#201600"),
    "notice": ("#ffe9b3", "#4d3c10"),
}

# ... in a world that is drawn on it ...
WORLD: Final[Mapping[str, tuple[str, str]]] = {
    "around": ("#eceff3", "#0b0f13"),
    "map": ("#ffffff", "#141b22"),
    "grid": ("#eef1f4", "#1a222b"),
    "edge": ("#c3cbd5", "#36424f"),
    "meal": NAMED["green"],
    "agent": NAMED["blue"],
    "hungry": ("#ffffff", "#141b22"),
    "outline": ("#56616e", "#8796a5"),
    "trail": NAMED["blue"],
    "chosen": (PLUM, "#f08ac8"),
    "sight": NAMED["blue"],
    "lit": NAMED["orange"],
    "flash": ("#00795a", "#7fe3c0"),
    "lesson": NAMED["purple"],
}

# ... of what is said of a claim, under its letters ...
VERDICTS: Final[Mapping[str, str]] = {
    "holds": "#a9dcc8",
    "undecided": "#f3f3f3",
    "does not hold": "#f2b08a",
    "not evaluated": "#ffffff",
}

# ... in a movie ...
MOVIE: Final[Mapping[str, str]] = {
    "background": "#fbfaf7",
    "agent": BLUE,
    "hungry": "#ffffff",
    "outline": "#56616e",
    "trail": "#9cc3e0",
    "meal": "#8ac0b0",
    "line": "#c3cbd5",
    "text": DARK_GRAY,
}

# ... and in a report: on a light screen, on a dark one, and on paper.
REPORT: Final[Mapping[str, tuple[str, str, str]]] = {
    "page": ("#fff", "#14181c", "#fff"),
    "text": ("#1d2329", "#e6eaee", "#000"),
    "soft": ("#5a646e", "#a3adb7", "#444"),
    "line": ("#d9dee3", "#37404a", "#bbb"),
    "raised": ("#f5f7f9", "#1d2329", "#fff"),
    "good": ("#00614a", "#4fd0a9", "#00614a"),
    "bad": ("#a63a00", "#ff9a63", "#a63a00"),
    "open": ("#434b54", "#c5ced6", "#434b54"),
    "none": ("#5a646e", "#a3adb7", "#5a646e"),
    "link": ("#00568a", "#7cc4f5", "#00568a"),
}


def shade(colour: str) -> str:
    """A colour by name, as it is on light ground; "#rrggbb" is itself. Raises KeyError for a name that there is not."""
    return colour if colour.startswith("#") else {**NAMED, **WORLD}[colour][0]


def lab_css() -> str:
    """The colours of the lab as variables of CSS, `--text` and so on; `--series-0` and on are those of curves, on any ground."""
    shades = {**NAMED, **PAGE, **WORLD}
    light = {name: on_light for name, (on_light, _) in shades.items()}
    dark = {name: on_dark for name, (_, on_dark) in shades.items()}
    series = {f"series-{number}": colour for number, colour in enumerate(SERIES_ON_SCREEN)}
    return f"{_root(light | series)}\n@media (prefers-color-scheme: dark) {{ {_root(dark)} }}\n"


def report_css() -> str:
    """The colours of a report as variables of CSS, for light and dark screens and for paper."""
    light, dark, paper = (
        {name: shades[ground] for name, shades in REPORT.items()} for ground in range(3)
    )
    on_dark, on_paper = (
        f"@media (prefers-color-scheme: dark) {{ {_root(dark)} }}",
        f"@media print {{ {_root(paper)} }}",
    )
    return "\n".join((_root(light), on_dark, on_paper))


def _root(colours: Mapping[str, str]) -> str:
    return f":root {{ {' '.join(f'--{name}: {colour};' for name, colour in colours.items())} }}"
