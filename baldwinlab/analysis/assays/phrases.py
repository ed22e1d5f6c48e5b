"""Terms of the assay section, which depend on whether a model has food and weights."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

from baldwinlab.experiment import BaseExperiment, Experiment


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
    """Return the terms for conditions of which any, or none, uses the MiniWorld model."""
    return FOOD_TERMS if is_foraging else FITNESS_TERMS


def fill_terms(text: str, terms: Terms) -> str:
    """Replace the placeholders of a text of this package. The text has no other braces."""
    return text.format_map(terms._asdict())
