"""Alleles of the genes of units and links."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import HALF, ONE

# Number of kinds of units.
N_KINDS: Final = 6
# Number of strengths of a link: -1, -1/2, 0, 1/2 and 1.
N_STRENGTHS: Final = 5


@compiled
def draw_allele(gene: int, n_units: int, draw: float) -> Any:
    """Return the allele of a gene for a uniform number `draw`.

    The genes are the kinds of the units (0 to 5), then the strengths of the links (-1 to 1), then
    the Hebbian flags of the links (0 or 1).
    """
    if gene < n_units:
        return np.float32(int(N_KINDS * draw))
    if gene < n_units + n_units * n_units:
        return np.float32(int(N_STRENGTHS * draw)) * HALF - ONE
    return np.float32(int(2 * draw))
