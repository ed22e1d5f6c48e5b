"""Criteria of the Baldwin effect from `questions.toml`, and the combination of verdicts.

The words of a criterion depend on whether the model has food and weights.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Final, Literal, NamedTuple

from baldwinlab.analysis.results.verdicts import (
    EQUAL,
    NO,
    NOT_MEASURABLE,
    NOT_MEASURED,
    UNDECIDED,
    YES,
)
from baldwinlab.experiment import BaseExperiment, Experiment

# A measure, and the time or the agents: ("off", "last") or ("first meal", "evolved").
Quantity = tuple[str, str]
Verdict = Literal["yes", "no", "equal in every run", "undecided", "not measurable", "not measured"]
# Sign of the difference a - b that answers a criterion with yes, by rule.
RULE_SIGNS: Final = {"greater": 1, "lower": -1}
# Innate fitness in the last generations: of a condition, and of the no-learning control.
INNATE_LAST: Final[Quantity] = ("off", "last")
CONTROL_LAST: Final[Quantity] = ("no-learning control", "last")


class Terms(NamedTuple):
    """Words that the texts of the section contain as placeholders, for example "{weights}"."""

    eat: str
    eats: str
    weights: str


FOOD_TERMS: Final = Terms(eat="eat", eats="eats", weights="weights")
# Agents of other models gain fitness, and learning may change more than weights.
FITNESS_TERMS: Final = Terms(eat="gain", eats="gains", weights="genome")


def has_foragers(experiments: Iterable[BaseExperiment]) -> bool:
    """Return whether any condition uses the MiniWorld model."""
    return any(isinstance(experiment, Experiment) for experiment in experiments)


def select_terms(is_foraging: bool) -> Terms:
    """Return the terms for MiniWorld conditions, or for conditions of other models only."""
    return FOOD_TERMS if is_foraging else FITNESS_TERMS


def fill_terms(text: str, terms: Terms) -> str:
    """Replace the placeholders of a text of this package. The text has no other braces."""
    return text.format_map(terms._asdict())


@dataclass(frozen=True)
class Criterion:
    """A question about the Baldwin effect, answered by comparing `a` with `b` run by run."""

    id: str
    # The assay that measures a and b.
    assay: str
    question: str
    # Description of the comparison.
    detail: str
    # "greater" if `a` must be greater than `b`, or "lower".
    rule: str
    a: Quantity
    b: Quantity
    # Phase of the Baldwin effect: 1 is fitness with learning, and 2 is innate fitness. None if the
    # criterion shows the mechanism.
    phase: int | None = None
    # "foragers" if the criterion applies only to the MiniWorld model.
    only_for: str = ""
    # Whether the effect is the change from b to a in percent, by the logarithm of the ratio.
    is_ratio: bool = False

    def applies_to(self, experiment: BaseExperiment) -> bool:
        """Return whether the criterion applies to the model of an experiment."""
        return self.only_for != "foragers" or isinstance(experiment, Experiment)


@cache
def _load_questions() -> dict[str, Any]:
    return tomllib.loads(
        (files("baldwinlab.analysis.assays") / "questions.toml").read_text("utf-8")
    )


@cache
def load_criteria(is_foraging: bool = True) -> tuple[Criterion, ...]:
    """Return all criteria of `questions.toml`, with the terms of models with or without food."""
    terms = select_terms(is_foraging)
    return tuple(_read_criterion(entry, terms) for entry in _load_questions()["criteria"])


def _read_criterion(entry: dict[str, Any], terms: Terms) -> Criterion:
    texts = {name: fill_terms(entry[name], terms) for name in ("question", "detail")}
    return Criterion(**{**entry, **texts, "a": tuple(entry["a"]), "b": tuple(entry["b"])})


def load_rules() -> dict[str, str]:
    """Return the description of each rule by name, "greater" or "lower"."""
    return dict(_load_questions()["rules"])


def combine_verdicts(verdicts: Sequence[Verdict]) -> Verdict:
    """Return no if any verdict is no or equal, yes if all are yes, else undecided.

    Criteria that are not measured or not measurable are ignored. If no other criterion exists, the
    result is "not measurable" if any verdict is, else "not measured".
    """
    measured_verdicts = set(verdicts) - {NOT_MEASURED, NOT_MEASURABLE}
    if not measured_verdicts:
        return NOT_MEASURABLE if NOT_MEASURABLE in verdicts else NOT_MEASURED
    if measured_verdicts & {NO, EQUAL}:
        return NO
    return YES if measured_verdicts == {YES} else UNDECIDED
