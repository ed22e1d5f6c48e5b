"""Conditions of one's own compared: each with the first on its map, such as controls with what they control for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from baldwinlab import statistics
from baldwinlab.factors import of_study
from baldwinlab.statistics import fitness

MEASURES = ("mean", "best")


class Contrast(NamedTuple):
    condition: str
    reference: str
    measure: str
    numbers: statistics.Comparison  # of the condition against the reference
    p_holm: float  # corrected for all contrasts of the study


def contrasts(study: xr.Dataset, last: int = 10) -> list[Contrast]:
    """Every condition against the first one that was run on its map, in best and mean fitness over the last generations.

    Conditions of no map share one. `study` has the dimensions (condition, run, generation, agent); a condition without runs is
    left out. Raises ValueError unless `last` is at least 1.
    """
    finals = {measure: fitness.final(study, measure, last) for measure in MEASURES}
    lived = [str(name) for name in study["condition"].values if bool(finals["mean"].sel(condition=name).notnull().any())]
    references: dict[str, str] = {}
    factors = of_study(study)
    pairs = [(name, references.setdefault(factors[name].map, name)) for name in lived]
    found = [
        (name, reference, measure, statistics.compare(_runs(finals[measure], name), _runs(finals[measure], reference)))
        for name, reference in pairs
        if name != reference
        for measure in MEASURES
    ]
    corrected = statistics.holm([numbers.p for *_, numbers in found])
    return [Contrast(*contrast, float(p)) for contrast, p in zip(found, corrected, strict=True)]


def _runs(values: xr.DataArray, condition: str) -> statistics.Sample:
    return np.asarray(values.sel(condition=condition).dropna("run").values, np.float64)
