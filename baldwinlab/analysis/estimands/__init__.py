"""Estimands of the Baldwin effect: one value per run for each question."""

from baldwinlab.analysis.estimands.estimate import (
    IMPOSSIBLE,
    MEASURED,
    NOT_MEASURABLE,
    Estimate,
    Measurability,
)
from baldwinlab.analysis.estimands.questions import ESTIMANDS, QUESTIONS, Estimand, estimate

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
