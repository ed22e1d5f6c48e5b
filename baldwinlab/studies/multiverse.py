"""Every variant of the paper, as one study: which experiments make it up.

A paper leaves choices open. Le (2019) leaves eight, R1 to R8 (docs/explanation/model.md).
Each variant among its presets changes one choice, and its description starts with the number of the choice.
A multiverse contains one variant at a time, or all combinations. It is a study with the conditions VARIANT/CONDITION/MAP,
such as `contact-5/evo/A`, or `contact-5+rank/evo/A` for a combination of two.

Source of the idea: S. Steegen, F. Tuerlinckx, A. Gelman and W. Vanpaemel, Increasing Transparency Through a Multiverse
Analysis, Perspectives on Psychological Science 11 (2016).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache, reduce
from itertools import product
from types import MappingProxyType
from typing import Any, NamedTuple

from baldwinlab.experiment import Experiment, merge
from baldwinlab.experiment.factors import Factors
from baldwinlab.papers import Paper, load, presets

STANDARD = "standard"
SEPARATOR = "+"


@cache
def alternatives(paper: Paper | None = None) -> Mapping[str, tuple[str, ...]]:
    """The choices that a paper (the default unless given) leaves open, each with the variants that make it otherwise."""
    paper = paper or load()
    found: dict[str, tuple[str, ...]] = {}
    for name in paper.names("variants"):
        if name != STANDARD:
            choice = paper.describe("variants", name).partition(":")[0]
            found[choice] = (*found.get(choice, ()), name)
    return MappingProxyType(dict(sorted(found.items())))


class Variant(NamedTuple):
    """A variant of a paper: the choices made otherwise than the standard, at most one alternative of each."""

    parts: tuple[str, ...]
    paper: Paper | None = None  # the default unless given

    @property
    def name(self) -> str:
        return SEPARATOR.join(self.parts) or STANDARD

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
        return reduce(merge, (paper.changes("variants", part) for part in self.parts), {})

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
        return "; ".join(paper.describe("variants", name) for name in self.parts or (STANDARD,))


def vary_one_at_a_time(paper: Paper | None = None) -> list[Variant]:
    """The standard variant, and each alternative by itself: of Le's paper, 15 variants."""
    return [
        Variant((), paper),
        *(Variant((name,), paper) for names in alternatives(paper).values() for name in names),
    ]


def vary_all(paper: Paper | None = None) -> list[Variant]:
    """Every combination of the choices, the standard first: of Le's paper, 4 * 4 * 2 * 4 * 2 * 2 * 2 * 2 = 2048 variants."""
    options = [((), *((name,) for name in names)) for names in alternatives(paper).values()]
    return [Variant(sum(taken, ()), paper) for taken in product(*options)]


def experiments(variants: Iterable[Variant]) -> list[Experiment]:
    """The paper's conditions under each variant.

    Genomes are kept of the first generation and of the last alone: of all generations, they would fill a disk.
    """
    found = []
    for variant in variants:
        changes = variant.changes
        for condition in _conditions(variant):
            record = {"genome_every": condition.evolution.generations}
            found.append(
                condition.replace(name=f"{variant.name}/{condition.name}", record=record, **changes)
            )
    return found


def _conditions(variant: Variant) -> list[Experiment]:
    return variant.paper.experiments() if variant.paper else presets.paper()


def factors(variants: Iterable[Variant]) -> dict[str, Factors]:
    """The factors of these experiments, by name."""
    found = {}
    for variant in variants:
        known = (variant.paper or load()).factors()
        for condition in _conditions(variant):
            found[f"{variant.name}/{condition.name}"] = known[condition.name]._replace(
                variant=variant.name
            )
    return found


def group_by_variant(
    conditions: Mapping[str, Factors], paper: Paper | None = None
) -> dict[Variant, dict[str, str]]:
    """The conditions of a multiverse by variant, each with the name that it has in the paper: evo/A."""
    found: dict[Variant, dict[str, str]] = {}
    for name, (learner, map_name, variant) in conditions.items():
        parts = () if variant == STANDARD else tuple(variant.split(SEPARATOR))
        found.setdefault(Variant(parts, paper), {})[name] = (
            f"{learner}/{map_name}" if map_name else learner
        )
    return found
