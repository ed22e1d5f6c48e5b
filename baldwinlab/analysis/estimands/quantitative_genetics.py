"""Quantitative genetics of stored generations: heritability, response, and maps of distances.

References
----------
.. [1] D. S. Falconer and T. F. C. Mackay, "Introduction to quantitative genetics", 4th edition
   (1996).
.. [2] R. Lande and S. J. Arnold, "The measurement of selection on correlated characters",
   Evolution 37 (1983).
.. [3] N. Mantel, "The detection of disease clustering and a generalized regression approach",
   Cancer Research 27 (1967).
.. [4] G. Mayley, "Landscapes, learning costs, and genetic assimilation", Evolutionary Computation 4
   (1996).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.spatial import distance

from baldwinlab.analysis.estimands.price_partition import (
    count_offspring,
    mean_of_parents,
    pair_generations,
)
from baldwinlab.analysis.estimands.selection_differentials import covariance


def estimate_heritability(trait: xr.DataArray, parents: xr.DataArray) -> xr.Dataset:
    """Estimate the heritability of a trait, and compare the breeder's equation with the response.

    h2 is the slope of the regression of children on the mean of their parents. It is NaN if the
    means of parents do not vary. The additive variance is V_A = h2 V_P, with the variance V_P of
    the trait in the parents' generation. The breeder's equation predicts the response R = h2 S,
    with S = Cov(W, z) / mean W and the realized number of offspring W. See Falconer and Mackay
    1996, chapters 10 and 11. `parents` are stored parents (run, generation, agent, parent).
    """
    before, after, parents_after = pair_generations(trait, parents, trait["generation"])
    midparent = mean_of_parents(before, parents_after)
    variance = midparent.var("agent")
    slope = xr.cov(midparent, after, "agent", ddof=0) / variance.where(variance > 0)
    differential = covariance(count_offspring(parents_after), before)
    return xr.Dataset(
        {
            "heritability": slope,
            "additive variance": slope * before.var("agent"),
            "differential": differential,
            "predicted response": slope * differential,
            "response": after.mean("agent") - before.mean("agent"),
        }
    )


def correlate_distances(genotypes: xr.DataArray, phenotypes: xr.DataArray) -> xr.DataArray:
    """Return the correlation of distances between genotypes and between phenotypes.

    It is the statistic of Mantel's test (1967): Pearson's correlation over all pairs of agents.
    Mayley (1996) names a high correlation as a condition of genetic assimilation. For bits, the
    squared Euclidean distance is the Hamming distance. The result is NaN if all distances are
    equal.
    """
    correlation: xr.DataArray = xr.apply_ufunc(
        _correlate_pairs,
        genotypes,
        phenotypes,
        input_core_dims=[["agent", "gene"], ["agent", "feature"]],
        vectorize=True,
        output_dtypes=[np.float64],
    )
    return correlation


def _correlate_pairs(
    genotypes: npt.NDArray[np.float64], phenotypes: npt.NDArray[np.float64]
) -> float:
    genetic = distance.pdist(genotypes.astype(np.float64))
    phenotypic = distance.pdist(phenotypes.astype(np.float64))
    if not (np.ptp(genetic) > 0 and np.ptp(phenotypic) > 0):
        return float("nan")
    return float(np.corrcoef(genetic, phenotypic)[0, 1])
