"""Windows of generations at the two ends of a run."""

from __future__ import annotations

import numpy as np
import xarray as xr


def split_ends(values: xr.DataArray, last: int) -> tuple[xr.DataArray, xr.DataArray]:
    """Return the values in the first and in the last generations.

    Not all generations need values. In a run of fewer than twice as many generations, each window
    has half of them, so that the windows do not overlap.
    """
    generation = values["generation"].astype(np.int64)
    n_generations = int(generation.max() - generation.min()) + 1
    length = max(1, min(last, n_generations // 2))
    first = values.where(generation < generation.min() + length, drop=True)
    return first, values.where(generation > generation.max() - length, drop=True)
