"""Canalization: how strongly genetic differences within a population appear in fitness.

Stored lives show only the genetic differences that a population has. The assay `canalization`
measures the effects of new mutations.

References
----------
.. [1] C. H. Waddington, "Canalization of development and the inheritance of acquired characters",
   Nature 150 (1942).
.. [2] I. Paenke, Y. Jin and J. Branke, "Balancing population- and individual-level adaptation in
   changing environments", Adaptive Behavior 17 (2009).
"""

from __future__ import annotations

import xarray as xr


def compare_variances(innate: xr.Dataset) -> xr.DataArray:
    """Return the variance of fitness with learning, divided by that without learning.

    The same newborns live with learning on and off. Fitness in each kind of life is divided by its
    mean, because selection acts on relative fitness. A ratio below 1 shows that learning buffers
    the genetic differences of the population.

    Parameters
    ----------
    innate : xr.Dataset
        The stored assay `innate`.

    Returns
    -------
    xr.DataArray
        Ratios of variances over agents (run, generation). NaN if fitness without learning does not
        vary, or if a mean is 0.

    References
    ----------
    Waddington 1942.
    """
    variances = {}
    for life in ("on", "off"):
        fitness = innate["energy"].sel(life=life, drop=True)
        mean = fitness.mean("agent")
        # The opportunity for selection: the variance of relative fitness.
        variances[life] = (fitness / mean.where(mean != 0)).var("agent")
    return variances["on"] / variances["off"].where(variances["off"] > 0)
