"""Assimilation and savings: the shares of learning that evolution has made unnecessary.

Savings are a measure of relearning. If evolution makes a part of learned behavior innate, agents
reach 90 % of their final performance earlier, even if the final performance is the same.

References
----------
.. [1] C. H. Waddington, "Genetic assimilation of an acquired character", Evolution 7 (1953).
.. [2] G. E. Hinton and S. J. Nowlan, "How learning can guide evolution", Complex Systems 1 (1987).
.. [3] H. Ebbinghaus, "Über das Gedächtnis" (1885).
"""

from __future__ import annotations

from typing import Final

import numpy as np
import xarray as xr

from baldwinlab.analysis.assays.values import RANDOM_NEWBORNS, parse_generation

FINAL_SHARE: Final = 0.9


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


def measure_assimilation(distance: xr.DataArray, last: int) -> xr.DataArray:
    """Return the share of the learned distance that is gone, by run.

    A = 1 - d_last / d_first, with the mean distances in the last and in the first generations. The
    distance is on the scale of the trait: bits, undefined alleles, or weights. Therefore A does not
    change if a constant is added to fitness. It is 1 if nothing remains to be learned, and below 0
    if the distance grows. It is NaN if the first distance is 0. See Waddington 1953.
    """
    first, final = (window.mean("generation") for window in split_ends(distance, last))
    return 1 - final / first.where(first > 0)


def find_learning_time(performance: xr.DataArray, ends: xr.DataArray) -> xr.DataArray:
    """Return the end of the first window of life with 90 % of the last window's performance.

    `performance` (..., window) is, for example, the items eaten per step, and `ends` are in steps.
    The time is NaN if the performance of the last window is not above 0.
    """
    final = performance.isel(window=-1)
    is_reached = performance >= FINAL_SHARE * final
    first_window = is_reached.argmax("window")
    return ends.isel(window=first_window).drop_vars("window", errors="ignore").where(final > 0)


def measure_foraging_times(within_life: xr.Dataset, steps: int) -> xr.DataArray:
    """Return the learning time of the average agent from the assay `within-life`, in steps."""
    names = [str(name) for name in within_life["newborns"].values if name != RANDOM_NEWBORNS]
    eaten = within_life["eaten_in_window"].sel(newborns=names).mean("agent")
    starts = eaten["window"].values
    # The last window may be shorter than the others.
    ends = xr.DataArray(np.append(starts[1:], steps), dims="window")
    times = find_learning_time(eaten / (ends - starts), ends)
    generations = [parse_generation(name) for name in names]
    return times.rename(newborns="generation").assign_coords(generation=generations)


def measure_savings(times: xr.DataArray, last: int) -> xr.DataArray:
    """Return the share of the learning time that is saved, by run; NaN without a time.

    1 - t_last / t_first, with the mean times in the last and in the first generations. An agent
    that does not reach its goal has the lifetime as its time.
    """
    first, final = (window.mean("generation") for window in split_ends(times, last))
    return 1 - final / first.where(first > 0)
