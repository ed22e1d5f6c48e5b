"""Quantitative genetics of stored generations: selection, Price's equation and heritability.

The standardized selection differential is the covariance of relative fitness and trait, in units of
the trait's standard deviation. This is the change of the mean trait by selection, before
inheritance and mutation. Learning guides selection if the differential is larger with learning than
without. Learning hides innate differences from selection if the differential is smaller.

Price's equation with the realized numbers of offspring W and the next generation z' is an identity:

    mean z' - mean z = Cov(W, z) / mean W + E(W (z_child - z)) / mean W

The first term is split by expected numbers of offspring, with learning off and on. The remainder
of the first term is drift, because parents are drawn at random.

References
----------
.. [1] A. Robertson, "A mathematical model of the culling process in dairy cattle", Animal
   Production 8 (1966).
.. [2] G. R. Price, "Selection and covariance", Nature 227 (1970).
.. [3] R. Lande and S. J. Arnold, "The measurement of selection on correlated characters",
   Evolution 37 (1983).
.. [4] S. A. Frank, "Natural selection. IV. The Price equation", Journal of Evolutionary Biology 25
   (2012).
.. [5] D. S. Falconer and T. F. C. Mackay, "Introduction to quantitative genetics", 4th edition
   (1996).
.. [6] N. Mantel, "The detection of disease clustering and a generalized regression approach",
   Cancer Research 27 (1967).
.. [7] G. Mayley, "Landscapes, learning costs, and genetic assimilation", Evolutionary Computation 4
   (1996).
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.spatial import distance

from baldwinlab.analysis.estimands.expected_offspring import RANK_SCHEMES, expect_offspring
from baldwinlab.experiment import BaseExperiment

PARTS: Final = ("selection without learning", "added by learning", "drift", "transmission")
# A standard deviation below this fraction of the largest absolute value is a rounding error.
SMALLEST_RELATIVE_SD = 1e-9


def count_offspring(parents: xr.DataArray) -> xr.DataArray:
    """Return the realized number of offspring of each agent. The mean over agents is 1.

    `parents` (..., agent, parent) are the two parents of each agent of the next generation. A child
    counts 1/2 for each parent.
    """

    def count(numbers: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
        slots = np.bincount(numbers.ravel(), minlength=len(numbers))
        shares: npt.NDArray[np.float64] = slots / numbers.shape[-1]  # 1/2 for each parent.
        return shares

    offspring: xr.DataArray = xr.apply_ufunc(
        count,
        parents.astype(np.int64),
        input_core_dims=[["agent", "parent"]],
        output_core_dims=[["agent"]],
        vectorize=True,
        output_dtypes=[np.float64],
    )
    return offspring


def mean_of_parents(trait: xr.DataArray, parents: xr.DataArray) -> xr.DataArray:
    """Return the mean trait (..., agent) of the two parents (..., agent, parent) of each child."""
    means: xr.DataArray = xr.apply_ufunc(
        lambda values, numbers: values[numbers].mean(axis=-1),
        trait,
        parents.astype(np.int64),
        input_core_dims=[["agent"], ["agent", "parent"]],
        output_core_dims=[["agent"]],
        vectorize=True,
        output_dtypes=[np.float64],
    )
    return means


def pair_generations(
    trait: xr.DataArray, parents: xr.DataArray, candidates: xr.DataArray
) -> tuple[xr.DataArray, xr.DataArray, xr.DataArray]:
    """Return the traits of parents and of their children, and the parents of the children.

    A candidate generation is left out if it or the next generation has no trait. The coordinate
    `generation` of all three arrays is the generation of the parents.
    """
    # Sums of float32 values would have only seven exact digits.
    trait = trait.astype(np.float64)
    numbers = set(trait["generation"].values.tolist())
    starts = [start for start in candidates.values.tolist() if {start, start + 1} <= numbers]
    before = trait.sel(generation=starts)
    after, parents_after = (
        values.sel(generation=[start + 1 for start in starts]).assign_coords(
            generation=before["generation"]
        )
        for values in (trait, parents)
    )
    return before, after, parents_after


def partition_change(
    trait: xr.DataArray,
    parents: xr.DataArray,
    offspring_off: xr.DataArray,
    offspring_on: xr.DataArray,
) -> xr.Dataset:
    """Partition the change of the mean of an innate trait z in every generation (Price 1970).

    `parents` are stored parents (run, generation, agent, parent). The expected numbers of offspring
    with learning off and on may lack generations. The result has "change" and the four parts of
    `PARTS`, which add up to the change:

    - selection without learning: Cov(w_off, z) / mean w_off, with expected offspring w_off.
    - added by learning: Cov(w_on, z) / mean w_on minus the first part.
    - drift: Cov(W, z) / mean W with realized offspring W, minus Cov(w_on, z) / mean w_on.
    - transmission: mean over children of z minus the mean of the parents' z. This is
      E(W (z_child - z)) / mean W.
    """
    before, after, parents_after = pair_generations(trait, parents, offspring_off["generation"])
    starts = before["generation"]
    realized = covariance(count_offspring(parents_after), before)
    without_learning = covariance(offspring_off.sel(generation=starts), before)
    with_learning = covariance(offspring_on.sel(generation=starts), before)
    parts = (
        without_learning,
        with_learning - without_learning,
        realized - with_learning,
        (after - mean_of_parents(before, parents_after)).mean("agent"),
    )
    change = after.mean("agent") - before.mean("agent")
    return xr.Dataset({"change": change, **dict(zip(PARTS, parts, strict=True))})


def covariance(weights: xr.DataArray, trait: xr.DataArray) -> xr.DataArray:
    """Return the covariance of relative fitness and a trait over agents.

    Cov(w / mean w, z) = mean(w z) / mean w - mean z, the first term of Price's equation. The
    fitness w is an expected or a realized number of offspring.
    """
    deviation = trait - trait.mean("agent")
    return (weights * deviation).mean("agent") / weights.mean("agent")


def standardize(differential: xr.DataArray, trait: xr.DataArray) -> xr.DataArray:
    """Return a differential in units of the trait's SD over agents, or NaN for a constant trait."""
    sd = trait.std("agent")
    smallest_sd = SMALLEST_RELATIVE_SD * abs(trait).max("agent")
    return differential / sd.where(sd > smallest_sd)


def compute_differentials(
    innate: xr.Dataset, trait: xr.DataArray, experiment: BaseExperiment
) -> xr.Dataset:
    """Compute selection differentials (run, generation): "on", "off", and "difference" (on - off).

    S = Cov(w / mean w, z) / SD(z) (Robertson 1966; Lande and Arnold 1983). The fitness w is the
    expected number of offspring of an agent under the selection scheme of the experiment, from the
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
    """Return the mean (run) of S_on - S_off over the generations in which the trait varies."""
    return differentials["difference"].mean("generation")


def relative_difference(differentials: xr.Dataset) -> xr.DataArray:
    """Return sum S_on / sum S_off - 1 (run), with the sums over the generations.

    The value is 0 if the same amount of selection acts with learning and without, and -1 if
    no selection with learning acts on the trait. The value is NaN if sum S_off is not above 0.
    """
    on, off = differentials["on"].sum("generation"), differentials["off"].sum("generation")
    return on / off.where(off > 0) - 1


def is_sign_informative(experiment: BaseExperiment, is_innate_fitness: bool) -> bool:
    """Return whether S_on - S_off can have both signs.

    If selection reads only ranks, S_off of innate fitness is the largest possible, so that S_on
    cannot be larger.
    """
    return not (is_innate_fitness and experiment.evolution.selection in RANK_SCHEMES)


def estimate_heritability(trait: xr.DataArray, parents: xr.DataArray) -> xr.Dataset:
    """Estimate the heritability of a trait, and compare the breeder's equation with the response.

    h2 is the slope of the regression of children on the mean of their parents. h2 is NaN if the
    means of parents do not vary. The additive variance is V_A = h2 V_P, with the variance V_P of
    the trait in the parents' generation. The breeder's equation predicts the response R = h2 S,
    with S = Cov(W, z) / mean W and the realized number of offspring W. See Falconer and Mackay
    1996, chapters 10 and 11. `parents` are stored parents (run, generation, agent, parent).

    Returns "heritability" h2, "additive variance" V_A, "differential" S, "predicted response" R and
    the observed "response" (run, generation).
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

    The result is the statistic of Mantel's test (1967): Pearson's correlation over all pairs of
    agents. Mayley (1996) names a high correlation as a condition of genetic assimilation. For bits,
    the squared Euclidean distance is the Hamming distance. The result is NaN if either all genetic
    or all phenotypic distances are equal.
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
