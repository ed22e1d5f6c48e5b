"""Partition of the change of a trait's mean from one generation to the next.

Price's equation with the realized numbers of offspring W is an identity:

    mean z' - mean z = Cov(W, z) / mean W + E(W (z_child - z)) / mean W

The first term is split by expected numbers of offspring, with learning off and on. The rest of it
is the sampling of parents, which is drift.

References
----------
.. [1] G. R. Price, "Selection and covariance", Nature 227 (1970).
.. [2] S. A. Frank, "Natural selection. IV. The Price equation", Journal of Evolutionary Biology 25
   (2012).
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.analysis.estimands.selection_differentials import covariance

PARTS: Final = ("selection without learning", "added by learning", "drift", "transmission")


def count_offspring(parents: xr.DataArray) -> xr.DataArray:
    """Return the realized number of offspring of each agent, whose mean is 1.

    `parents` (..., agent, parent) are those of the next generation. A child is half an offspring of
    each of its two parents.
    """

    def count(numbers: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
        slots = np.bincount(numbers.ravel(), minlength=len(numbers))
        shares: npt.NDArray[np.float64] = slots / numbers.shape[-1]
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
    """Return the mean trait of the two parents (..., agent, parent) of each child."""
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

    Only those of the candidate generations are returned in which both have a trait. The coordinate
    `generation` is that of the parents' generation.
    """
    # Sums of float32 values would be exact only to seven digits.
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

    - selection without learning: Cov(w_off, z) / mean w_off, w_off expected.
    - added by learning: the same with w_on, minus the first part.
    - drift: the same with the realized number of offspring, minus that with w_on.
    - transmission: mean over children of z minus the mean of the parents' z, which is
      E(W (z_child - z)) / mean W with the realized number of offspring W.
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
