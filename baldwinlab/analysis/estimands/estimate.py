"""One estimand of one condition: what was measured, on which scale, or why not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import xarray as xr

Measurability = Literal["impossible", "not measurable", "measured"]
IMPOSSIBLE: Final[Measurability] = "impossible"
NOT_MEASURABLE: Final[Measurability] = "not measurable"
MEASURED: Final[Measurability] = "measured"


@dataclass(frozen=True)
class Estimate:
    """An estimand of a condition, with one value per run.

    Attributes
    ----------
    question : str
        Name of the question, for example "assimilation".
    trait : str
        Trait or measure on which the question is answered.
    unit : str
        Unit of the values.
    measurability : str
        "impossible": the construction of the experiment determines the answer.
        "not measurable": the stored data or the scale cannot show an effect.
        "measured": the values are defined.
    reason : str
        Reason for the measurability, or the definition of the values, in one sentence.
    values : xr.DataArray or None
        Values (run). 0 means no effect, and a value above 0 means yes. NaN marks a run in which
        the value is undefined. None unless `measurability` is "measured".
    equivalence_bound : float
        Largest absolute effect that counts as equivalent to no effect, in the unit of the values.
    """

    question: str
    trait: str
    unit: str
    measurability: Measurability
    reason: str
    values: xr.DataArray | None
    equivalence_bound: float
