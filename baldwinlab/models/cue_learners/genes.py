"""Alleles of the genes of units and links."""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled

ONE = np.float32(1)
HALF = np.float32(0.5)


@compiled
def draw_allele(gene: int, units: int, draw: float) -> Any:
    """Return the allele of a gene for a uniform number: a kind, a strength or a Hebbian flag."""
    if gene < units:
        return np.float32(int(6 * draw))
    if gene < units + units * units:
        return np.float32(int(5 * draw)) * HALF - ONE
    return np.float32(int(2 * draw))
