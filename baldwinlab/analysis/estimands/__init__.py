"""Estimands of the Baldwin effect: one value per run for each question."""

from baldwinlab.analysis.estimands.questions import (
    CANNOT_RISE,
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
    "CANNOT_RISE",
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
