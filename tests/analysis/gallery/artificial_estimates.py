"""Artificial estimates, for which the correct decisions are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from baldwinlab.analysis.estimands.questions import MEASURED, Estimate, Measurability, classify


def make_estimate(
    values: Any = None,
    *,
    question: str = "assimilation",
    measurability: Measurability = MEASURED,
    unit: str = "share",
    bound: float = 0.1,
) -> Estimate:
    """Return an estimate with one value per run, or without values."""
    array = None if values is None else xr.DataArray(np.asarray(values, float), dims="run")
    estimate = Estimate(
        question=question,
        trait="innate fitness",
        unit=unit,
        measurability=measurability,
        reason="",
        values=array,
        equivalence_bound=bound,
    )
    return classify(estimate)
