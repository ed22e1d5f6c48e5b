"""Alleles of the genes of units and links."""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled

ONE = np.float32(1)
HALF = np.float32(0.5)


@compiled
def draw_allele(gene: int, units: int, draw: float) -> Any:
    """Return the allele of a gene for a uniform number `draw`.

    The genes are the kinds of the units (0 to 5), then the strengths of the links (-1 to 1), then
    the Hebbian flags of the links (0 or 1).
    """
    if gene < units:
        return np.float32(int(6 * draw))
    if gene < units + units * units:
        return np.float32(int(5 * draw)) * HALF - ONE
    return np.float32(int(2 * draw))
