"""Multiverse: the conditions of a paper with each variant of the model, in one study.

A paper leaves choices open. Le (2019) leaves eight, R1 to R8 (docs/explanation/model.md).
Each variant among the presets of a paper changes one choice, for example R2. The description of a
variant starts with the name of this choice. A multiverse contains one variant at a time, or all
combinations of variants. The conditions of a multiverse have names of the form
VARIANT/CONDITION/MAP: `contact-5/evo/A` has one variant, `contact-5+rank/evo/A` two.

The method is from S. Steegen, F. Tuerlinckx, A. Gelman and W. Vanpaemel, Increasing Transparency
Through a Multiverse Analysis, Perspectives on Psychological Science 11 (2016).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache, reduce
from itertools import chain, product
from types import MappingProxyType
from typing import Any, NamedTuple

from baldwinlab.experiment import Experiment, merge
from baldwinlab.experiment.conditions import Factors
from baldwinlab.papers import Paper, load, presets

STANDARD_VARIANT = "standard"
VARIANT_SEPARATOR = "+"


@cache
def alternatives(paper: Paper | None = None) -> Mapping[str, tuple[str, ...]]:
    """Return the variants of each open choice without the standard: {"R2": ("contact-5", ...)}."""
    paper = paper or load()
    variants: dict[str, tuple[str, ...]] = {}
    for name in paper.names("variants"):
        if name != STANDARD_VARIANT:
            # The description of a variant is "CHOICE: text".
            choice, _, _ = paper.describe("variants", name).partition(":")
            variants[choice] = (*variants.get(choice, ()), name)
    return MappingProxyType(dict(sorted(variants.items())))


class Variant(NamedTuple):
    """Variant of the model of a paper."""

    parts: tuple[str, ...]  # Names of the non-standard alternatives, at most one for each choice.
    paper: Paper | None = None  # The paper; the default paper if None.

    @property
    def name(self) -> str:
        """Name of the variant: `standard`, `contact-5` or `contact-5+rank`."""
        return VARIANT_SEPARATOR.join(self.parts) or STANDARD_VARIANT

    @property
    def choices(self) -> dict[str, str]:
        """The selected alternative of each choice: {"R2": "contact-5"}."""
        choice_by_alternative = {
            name: choice for choice, names in alternatives(self.paper).items() for name in names
        }
        return {
            choice_by_alternative[name]: name
            for name in self.parts
            if name in choice_by_alternative
        }

    @property
    def changes(self) -> dict[str, Any]:
        """The changed settings as arguments of `Experiment.replace`."""
        paper = self.paper or load()
        changes_by_part = (paper.changes("variants", part) for part in self.parts)
        return reduce(merge, changes_by_part, {})

    @property
    def fields(self) -> dict[str, Any]:
        """The changed settings by path: {"contact.reach": 5}."""
        return {
            f"{section}.{field}": value
            for section, fields in self.changes.items()
            for field, value in fields.items()
        }

    @property
    def description(self) -> str:
        """The descriptions of the alternatives in one line."""
        paper = self.paper or load()
        names = self.parts or (STANDARD_VARIANT,)
        return "; ".join(paper.describe("variants", name) for name in names)


def vary_one_at_a_time(paper: Paper | None = None) -> list[Variant]:
    """Return the standard variant and each single alternative; Le (2019) has 15 variants."""
    standard = Variant((), paper)
    names = [name for names in alternatives(paper).values() for name in names]
    return [standard, *(Variant((name,), paper) for name in names)]


def combine_all_choices(paper: Paper | None = None) -> list[Variant]:
    """Return all combinations of the choices, the standard first.

    Le (2019) has 4 * 4 * 2 * 4 * 2 * 2 * 2 * 2 = 2048 combinations.
    """
    # The options of a choice are the empty tuple, the standard, and one tuple per alternative.
    options = [((), *((name,) for name in names)) for names in alternatives(paper).values()]
    return [Variant(tuple(chain(*selected)), paper) for selected in product(*options)]


def experiments(variants: Iterable[Variant]) -> list[Experiment]:
    """Return the conditions of the paper under each variant.

    Only the genomes of the first and the last generation are stored, which saves disk space.
    """
    conditions = []
    for variant in variants:
        changes = variant.changes
        for condition in _conditions(variant):
            record = {"genome_every": condition.evolution.generations}
            name = f"{variant.name}/{condition.name}"
            conditions.append(condition.replace(name=name, record=record, **changes))
    return conditions


def _conditions(variant: Variant) -> list[Experiment]:
    return variant.paper.experiments() if variant.paper else presets.paper()


def factors(variants: Iterable[Variant]) -> dict[str, Factors]:
    """Return the factors of the conditions of `experiments`, by name."""
    factors_by_name = {}
    for variant in variants:
        paper_factors = (variant.paper or load()).factors()
        for condition in _conditions(variant):
            condition_factors = paper_factors[condition.name]._replace(variant=variant.name)
            factors_by_name[f"{variant.name}/{condition.name}"] = condition_factors
    return factors_by_name


def group_by_variant(
    conditions: Mapping[str, Factors], paper: Paper | None = None
) -> dict[Variant, dict[str, str]]:
    """Return the name in the paper of each condition, by variant: {"contact-5/evo/A": "evo/A"}."""
    groups: dict[Variant, dict[str, str]] = {}
    for name, (learner, map_name, variant, _) in conditions.items():
        parts = () if variant == STANDARD_VARIANT else tuple(variant.split(VARIANT_SEPARATOR))
        paper_name = f"{learner}/{map_name}" if map_name else learner
        groups.setdefault(Variant(parts, paper), {})[name] = paper_name
    return groups
