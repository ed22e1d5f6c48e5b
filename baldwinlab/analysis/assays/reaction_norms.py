"""Reaction norms over the amount of learning: intercept and slope, with one value per run.

References
----------
.. [1] C. H. Waddington, "Genetic assimilation of an acquired character", Evolution 7 (1953).
.. [2] R. Lande, "Adaptation to an extraordinary environment by evolution of phenotypic plasticity
   and genetic assimilation", Journal of Evolutionary Biology 22 (2009).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import xarray as xr

QUANTITY_PREFIX: Final = "reaction norm: "
PARAMETERS: Final = ("intercept", "slope")
LAST_MINUS_FIRST: Final = "last minus first generation"


def compute_parameters(data: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return the intercept and the slope of the reaction norm of each generation.

    The intercept is the mean fitness without learning, the factor 0. The slope is the mean fitness
    with the learning of the study, the factor 1, minus the intercept. No linear norm is assumed.

    Returns "intercept" and "slope" (run, generation), in the unit of fitness.

    References
    ----------
    Lande 2009.
    """
    fitness = data["energy"].mean("agent")
    innate, learned = (fitness.sel(factor=factor, drop=True) for factor in (0, 1))
    return {"intercept": innate, "slope": learned - innate}


def compute_quantities(data: xr.Dataset) -> Iterator[tuple[tuple[str, str], xr.DataArray]]:
    """Yield the values (run) of both parameters, their changes, and all points of the norms.

    Assimilation raises the intercept and lowers the slope. Both changes are invariant to a constant
    that is added to fitness.
    """
    generations = data["generation"].values.tolist()
    for parameter, values in compute_parameters(data).items():
        name = f"{QUANTITY_PREFIX}{parameter}"
        for generation in generations:
            yield (name, f"generation {generation}"), values.sel(generation=generation)
        first, last = (values.isel(generation=end, drop=True) for end in (0, -1))
        yield (name, LAST_MINUS_FIRST), last - first
    fitness = data["energy"].mean("agent")
    for factor in data["factor"].values.tolist():
        for generation in generations:
            point = fitness.sel(factor=factor, generation=generation)
            name = f"{QUANTITY_PREFIX}fitness with {factor:g} times the learning"
            yield (name, f"generation {generation}"), point
