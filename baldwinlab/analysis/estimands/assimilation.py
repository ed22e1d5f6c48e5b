"""Assimilation: the share of the learned distance that evolution has made unnecessary.

References
----------
.. [1] C. H. Waddington, "Genetic assimilation of an acquired character", Evolution 7 (1953).
.. [2] G. E. Hinton and S. J. Nowlan, "How learning can guide evolution", Complex Systems 1 (1987).
"""

from __future__ import annotations

import xarray as xr

from baldwinlab.analysis.estimands.windows import split_ends


def measure_assimilation(distance: xr.DataArray, last: int) -> xr.DataArray:
    """Return the share of the learned distance that is gone, by run.

    A = 1 - d_last / d_first, with the mean distances in the last and in the first generations. The
    distance is on the scale of the trait: bits, undefined alleles, or weights. Therefore A does not
    change if a constant is added to fitness. It is 1 if nothing remains to be learned, and below 0
    if the distance grows. It is NaN if the first distance is 0. See Waddington 1953.
    """
    first, final = (window.mean("generation") for window in split_ends(distance, last))
    return 1 - final / first.where(first > 0)
