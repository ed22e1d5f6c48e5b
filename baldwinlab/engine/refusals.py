"""What is said where a foreign phase cannot be compiled: one sentence in the place of pages of Numba's."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from types import FunctionType
from typing import Any, Final

from baldwinlab.errors import PartError

OURS: Final = Path(__file__).parents[1]
LONGEST: Final = 300  # characters of a reason
BEGINS: Final = re.compile(r"Failed in nopython mode pipeline.*\n")
ENDS: Final = re.compile(r"\n\s*(There (are|is) \d+ candidate|During:|File \"|- Of which|- argument|$)")
PLACE: Final = re.compile(r'(?:File "|at )([^"\n]+?)(?:", line | \()(\d+)')


def refusal(error: Exception, phases: Iterable[Callable[..., Any]]) -> PartError | None:
    """The sentence on a fault of Numba's that one of the foreign `phases` makes; None where none of them does."""
    foreign = [each for each in phases if isinstance(each, FunctionType) and OURS not in Path(each.__code__.co_filename).parents]
    text = BEGINS.split(re.sub(r"\x1b\[[0-9;]*m", "", str(error)))[-1]  # what is innermost comes last
    reason = " ".join(ENDS.split(text)[0].split())[:LONGEST]
    named = [(Path(file).name, int(line)) for file, line in PLACE.findall(text)]
    for phase in foreign:
        file, lines = phase.__code__.co_filename, [line for _, _, line in phase.__code__.co_lines() if line]
        within = [line for name, line in named if name == Path(file).name and min(lines) <= line <= max(lines)]
        unknown = re.search(r"name '(\w+)' is not defined", text)
        if within or (unknown and unknown[1] in phase.__code__.co_names):
            line = within[0] if within else min(lines)
            return PartError(f"{phase.__qualname__} cannot be compiled ({file}:{line}): {reason}")
    helpers = {each.__code__.co_filename for each in foreign}
    for name, line in named:  # in a function that a phase calls
        for file in helpers:
            if Path(file).name == name:
                return PartError(f"{file}:{line} cannot be compiled: {reason}")
    return None
