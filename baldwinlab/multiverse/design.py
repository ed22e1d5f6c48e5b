"""Every reading of the paper, as one study: which experiments make it up.

The paper leaves eight choices open, R1 to R8 (docs/model.md). Each reading among the presets makes one of them otherwise than
the standard reading, and says at the head of its description which. A multiverse takes them one at a time, or in all
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

STANDARD = "standard"
JOINED_BY = "+"


@cache
def alternatives() -> Mapping[str, tuple[str, ...]]:
    """The open choices, R1 to R8, each with the readings that make it otherwise than the standard."""
    found: dict[str, tuple[str, ...]] = {}
    for name in presets.names("readings"):
        if name != STANDARD:
            choice = presets.describe("readings", name).partition(":")[0]
            found[choice] = (*found.get(choice, ()), name)
    return MappingProxyType(dict(sorted(found.items())))


class Reading(NamedTuple):
    """A reading of the paper: the choices made otherwise than the standard, at most one alternative of each."""

    parts: tuple[str, ...]

    @property
    def name(self) -> str:
        return JOINED_BY.join(self.parts) or STANDARD

    @property
    def choices(self) -> dict[str, str]:
        """The alternative taken, by choice: {"R2": "contact-5"}."""
        return {choice: part for part in self.parts for choice, names in alternatives().items() if part in names}

    @property
    def changes(self) -> dict[str, Any]:
        """The fields that it sets, as `Experiment.replace` takes them."""
        return reduce(merge, (presets.changes(part) for part in self.parts), {})

    @property
    def fields(self) -> dict[str, Any]:
        """The same by path: {"contact.reach": 5}."""
        return {f"{part}.{field}": value for part, fields in self.changes.items() for field, value in fields.items()}

    @property
    def description(self) -> str:
        """What it is, in a line."""
        return "; ".join(presets.describe("readings", name) for name in self.parts or (STANDARD,))


def one_at_a_time() -> list[Reading]:
    """The standard reading, and each alternative by itself: 15 readings."""
    return [Reading(()), *(Reading((name,)) for names in alternatives().values() for name in names)]


def combinations() -> list[Reading]:
    """Every combination of the choices, the standard first: 4 * 4 * 2 * 4 * 2 * 2 * 2 * 2 = 2048 readings."""
    options = [((), *((name,) for name in names)) for names in alternatives().values()]
    return [Reading(sum(taken, ())) for taken in product(*options)]


def experiments(readings: Iterable[Reading]) -> list[Experiment]:
    """The paper's six conditions under each reading.

    Genomes are kept of the first generation and of the last alone: of all generations, they would fill a disk.
    """
    paper = presets.paper()
    found = []
    for reading in readings:
        changes = reading.changes
        for condition in paper:
            record = {"genome_every": condition.evolution.generations}
            found.append(condition.replace(name=f"{reading.name}/{condition.name}", record=record, **changes))
    return found


def factors(readings: Iterable[Reading]) -> dict[str, Factors]:
    """The factors of these experiments, by name."""
    known = presets.factors()
    paper = [condition.name for condition in presets.paper()]
    return {f"{reading.name}/{name}": known[name]._replace(reading=reading.name) for reading in readings for name in paper}


def by_reading(conditions: Mapping[str, Factors]) -> dict[Reading, dict[str, str]]:
    """The conditions of a multiverse by reading, each with the name that it has in the paper: evo/A."""
    found: dict[Reading, dict[str, str]] = {}
    for name, (learner, map_name, reading) in conditions.items():
        parts = () if reading == STANDARD else tuple(reading.split(JOINED_BY))
        found.setdefault(Reading(parts), {})[name] = f"{learner}/{map_name}"
    return found
