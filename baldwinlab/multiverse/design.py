"""Every reading of the paper, as one study: which experiments make it up.

A paper leaves choices open; Le's, eight: R1 to R8 (docs/model.md). Each reading among its presets makes one of them otherwise
than the standard reading, and says at the head of its description which. A multiverse takes them one at a time, or in all
combinations. It is a study whose conditions are READING/CONDITION/MAP, such as `contact-5/evo/A`, or
`contact-5+rank/evo/A` where two choices are made at once.

Source of the idea: S. Steegen, F. Tuerlinckx, A. Gelman and W. Vanpaemel, Increasing Transparency Through a Multiverse
Analysis, Perspectives on Psychological Science 11 (2016).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache, reduce
from itertools import product
from types import MappingProxyType
from typing import Any, NamedTuple

from baldwinlab import presets
from baldwinlab.experiment import Experiment, merge
from baldwinlab.factors import Factors
from baldwinlab.papers import Paper, load

STANDARD = "standard"
JOINED_BY = "+"


@cache
def alternatives(paper: Paper | None = None) -> Mapping[str, tuple[str, ...]]:
    """The choices that a paper (the default unless given) leaves open, each with the readings that make it otherwise."""
    paper = paper or load()
    found: dict[str, tuple[str, ...]] = {}
    for name in paper.names("readings"):
        if name != STANDARD:
            choice = paper.describe("readings", name).partition(":")[0]
            found[choice] = (*found.get(choice, ()), name)
    return MappingProxyType(dict(sorted(found.items())))


class Reading(NamedTuple):
    """A reading of a paper: the choices made otherwise than the standard, at most one alternative of each."""

    parts: tuple[str, ...]
    paper: Paper | None = None  # the default unless given

    @property
    def name(self) -> str:
        return JOINED_BY.join(self.parts) or STANDARD

    @property
    def choices(self) -> dict[str, str]:
        """The alternative taken, by choice: {"R2": "contact-5"}."""
        return {
            choice: part
            for part in self.parts
            for choice, names in alternatives(self.paper).items()
            if part in names
        }

    @property
    def changes(self) -> dict[str, Any]:
        """The fields that it sets, as `Experiment.replace` takes them."""
        paper = self.paper or load()
        return reduce(merge, (paper.changes("readings", part) for part in self.parts), {})

    @property
    def fields(self) -> dict[str, Any]:
        """The same by path: {"contact.reach": 5}."""
        return {
            f"{part}.{field}": value
            for part, fields in self.changes.items()
            for field, value in fields.items()
        }

    @property
    def description(self) -> str:
        """What it is, in a line."""
        paper = self.paper or load()
        return "; ".join(paper.describe("readings", name) for name in self.parts or (STANDARD,))


def one_at_a_time(paper: Paper | None = None) -> list[Reading]:
    """The standard reading, and each alternative by itself: of Le's paper, 15 readings."""
    return [
        Reading((), paper),
        *(Reading((name,), paper) for names in alternatives(paper).values() for name in names),
    ]


def combinations(paper: Paper | None = None) -> list[Reading]:
    """Every combination of the choices, the standard first: of Le's paper, 4 * 4 * 2 * 4 * 2 * 2 * 2 * 2 = 2048 readings."""
    options = [((), *((name,) for name in names)) for names in alternatives(paper).values()]
    return [Reading(sum(taken, ()), paper) for taken in product(*options)]


def experiments(readings: Iterable[Reading]) -> list[Experiment]:
    """The paper's conditions under each reading.

    Genomes are kept of the first generation and of the last alone: of all generations, they would fill a disk.
    """
    found = []
    for reading in readings:
        changes = reading.changes
        for condition in _conditions(reading):
            record = {"genome_every": condition.evolution.generations}
            found.append(
                condition.replace(name=f"{reading.name}/{condition.name}", record=record, **changes)
            )
    return found


def _conditions(reading: Reading) -> list[Experiment]:
    return reading.paper.experiments() if reading.paper else presets.paper()


def factors(readings: Iterable[Reading]) -> dict[str, Factors]:
    """The factors of these experiments, by name."""
    found = {}
    for reading in readings:
        known = (reading.paper or load()).factors()
        for condition in _conditions(reading):
            found[f"{reading.name}/{condition.name}"] = known[condition.name]._replace(
                reading=reading.name
            )
    return found


def by_reading(
    conditions: Mapping[str, Factors], paper: Paper | None = None
) -> dict[Reading, dict[str, str]]:
    """The conditions of a multiverse by reading, each with the name that it has in the paper: evo/A."""
    found: dict[Reading, dict[str, str]] = {}
    for name, (learner, map_name, reading) in conditions.items():
        parts = () if reading == STANDARD else tuple(reading.split(JOINED_BY))
        found.setdefault(Reading(parts, paper), {})[name] = (
            f"{learner}/{map_name}" if map_name else learner
        )
    return found
