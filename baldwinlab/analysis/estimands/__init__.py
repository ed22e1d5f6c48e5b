"""Estimands of the Baldwin effect: one value per run for each question."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import xarray as xr

from baldwinlab.analysis.estimands.estimate import NOT_MEASURABLE, Estimate
from baldwinlab.experiment import BaseExperiment

QUESTIONS: Final = (
    "selection-by-learning",
    "fork-history",
    "fork-regime",
    "assimilation",
    "savings",
)


def estimate(
    data: xr.Dataset, assays: Mapping[str, xr.Dataset], experiment: BaseExperiment, last: int
) -> list[Estimate]:
    """Estimate every question for one condition that evolves and learns.

    Parameters
    ----------
    data : xr.Dataset
        The runs of the condition, with the dimensions (run, generation, agent).
    assays : mapping of str to xr.Dataset
        Stored assays of the condition by name.
    experiment : BaseExperiment
        Experiment of the condition.
    last : int
        Number of generations in the first and the last window.

    Returns
    -------
    list of Estimate
        One estimate per question, in the order of `QUESTIONS`.
    """
    return [
        Estimate(
            question=question,
            trait="",
            unit="1",
            measurability=NOT_MEASURABLE,
            reason="No assay of this question is stored.",
            values=None,
            equivalence_bound=0.0,
        )
        for question in QUESTIONS
    ]
