"""Rules of claims: which number of a comparison decides a claim, and the limits of this number.

The rules are tables of `rules.toml`, which explains the keys.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from math import inf
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

# A number; a pair of numbers for a rule with two bounds; None for a rule without a bound.
Bound = float | tuple[float, float] | None
Kind = Literal["direction", "survival", "interval", "number"]
Statistic = Literal["median", "mean", "minimum", "maximum", "probability"]

RANGES: Final[Mapping[str, tuple[int, Callable[[Any], tuple[float, float]]]]] = {
    "any": (0, lambda _: (-inf, inf)),
    "zero": (0, lambda _: (0.0, 0.0)),
    "above": (1, lambda bound: (bound, inf)),
    "below": (1, lambda bound: (-inf, bound)),
    "equal": (1, lambda bound: (bound, bound)),
    "around zero": (1, lambda bound: (-bound, bound)),
    "between": (2, tuple),
}
"""The number of values in the bound, and the function that returns both ends, by range."""


class Rule(NamedTuple):
    """A rule that decides the comparison of a claim, with the keys of `rules.toml`."""

    kind: Kind
    text: str
    sign: int = 0  # 0 for other kinds than "direction".
    allowed_range: str = "any"
    statistic: Statistic = "median"
    has_reference: bool = False
    contains_limits: bool = False

    @property
    def n_bounds(self) -> int:
        """The number of values in the bound: 0, 1 or 2."""
        return RANGES[self.allowed_range][0]

    def limits(self, bound: Bound) -> tuple[float, float]:
        """Return the smallest and the largest number with which the claim holds."""
        return RANGES[self.allowed_range][1](bound)


RULES: Final[Mapping[str, Rule]] = {
    name: Rule(**table)
    for name, table in tomllib.loads(
        Path(__file__).with_name("rules.toml").read_text("utf-8")
    ).items()
}
