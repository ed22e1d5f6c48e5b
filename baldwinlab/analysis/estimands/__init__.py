"""Estimands of the Baldwin effect: one value per run for each question."""

from baldwinlab.analysis.estimands.questions import (
    ESTIMANDS,
    IMPOSSIBLE,
    MEASURED,
    NOT_MEASURABLE,
    QUESTIONS,
    Estimand,
    Estimate,
    Measurability,
    estimate,
)

__all__ = [
    "ESTIMANDS",
    "IMPOSSIBLE",
    "MEASURED",
    "NOT_MEASURABLE",
    "QUESTIONS",
    "Estimand",
    "Estimate",
    "Measurability",
    "estimate",
]
