"""Selection differentials of an innate trait, with learning on and off.

The standardized selection differential is the covariance of relative fitness and trait, in units of
the trait's standard deviation. It is the change of the mean trait by selection, before inheritance
and mutation. Learning guides selection if the differential is larger with learning than without,
and hides innate differences from selection if it is smaller.

References
----------
.. [1] A. Robertson, "A mathematical model of the culling process in dairy cattle", Animal
   Production 8 (1966).
.. [2] G. R. Price, "Selection and covariance", Nature 227 (1970).
.. [3] R. Lande and S. J. Arnold, "The measurement of selection on correlated characters",
   Evolution 37 (1983).
"""

from __future__ import annotations

import xarray as xr

from baldwinlab.analysis.estimands.expected_offspring import RANK_SCHEMES, expect_offspring
from baldwinlab.experiment import BaseExperiment

# A standard deviation below this share of the largest absolute value is rounding.
SMALLEST_RELATIVE_SD = 1e-9


def covariance(weights: xr.DataArray, trait: xr.DataArray) -> xr.DataArray:
    """Return the covariance of relative fitness and a trait over agents.

    Cov(w / mean w, z) = mean(w z) / mean w - mean z, the first term of Price's equation. The
    fitness w is an expected or a realized number of offspring.
    """
    deviation = trait - trait.mean("agent")
    return (weights * deviation).mean("agent") / weights.mean("agent")


def standardize(differential: xr.DataArray, trait: xr.DataArray) -> xr.DataArray:
    """Return a differential in units of the trait's SD over agents; NaN where it does not vary."""
    sd = trait.std("agent")
    smallest_sd = SMALLEST_RELATIVE_SD * abs(trait).max("agent")
    return differential / sd.where(sd > smallest_sd)


def compute_differentials(
    innate: xr.Dataset, trait: xr.DataArray, experiment: BaseExperiment
) -> xr.Dataset:
    """Compute the selection differentials with learning "on" and "off", and their "difference".

    S = Cov(w / mean w, z) / SD(z) (Robertson 1966; Lande and Arnold 1983). The fitness w is the
    expected number of offspring of an agent under the selection scheme of the experiment, from its
    fitness with learning on or off in the assay `innate`. The innate trait z is (run, generation,
    agent).
    """
    differentials = {}
    for life in ("on", "off"):
        offspring = expect_offspring(innate["energy"].sel(life=life, drop=True), experiment)
        differentials[life] = standardize(covariance(offspring, trait), trait)
    difference = differentials["on"] - differentials["off"]
    return xr.Dataset({**differentials, "difference": difference})


def average_difference(differentials: xr.Dataset) -> xr.DataArray:
    """Return the mean of S_on - S_off over the generations in which the trait varies (run)."""
    return differentials["difference"].mean("generation")


def relative_difference(differentials: xr.Dataset) -> xr.DataArray:
    """Return the sum of S_on over the generations, divided by that of S_off, minus 1 (run).

    The value is 0 if the same amount of selection acts with learning and without, and -1 if
    no selection with learning acts on the trait. It is NaN if the sum of S_off is not above 0.
    """
    on, off = differentials["on"].sum("generation"), differentials["off"].sum("generation")
    return on / off.where(off > 0) - 1


def is_sign_informative(experiment: BaseExperiment, is_innate_fitness: bool) -> bool:
    """Return whether S_on - S_off can have both signs.

    If selection reads only ranks, S_off of innate fitness is the largest possible, so that S_on
    cannot be larger.
    """
    return not (is_innate_fitness and experiment.evolution.selection in RANK_SCHEMES)
