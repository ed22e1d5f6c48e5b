"""Canalization: variances of relative fitness with and without learning."""

from __future__ import annotations

import numpy as np
import xarray as xr

from baldwinlab.analysis.estimands.canalization import compare_variances
from tests.analysis.estimands.conftest import Stored


def test_a_gain_that_shrinks_relative_differences_gives_a_ratio_below_1() -> None:
    off = np.array([1.0, 2.0, 3.0])
    energy = np.stack([off, off + 2, np.full(3, 5.0)])
    innate = xr.Dataset({"energy": (("life", "agent"), energy)}, {"life": ["off", "on", "same"]})
    # The differences are the same, and the mean is 4 instead of 2.
    np.testing.assert_allclose(compare_variances(innate), 1 / 4)


def test_learning_buffers_on_concave_and_amplifies_on_convex_slopes(
    stored: dict[str, Stored],
) -> None:
    ratios = {
        shape: compare_variances(stored[f"stepping/{shape}"].innate)
        for shape in ("convex", "exponential", "concave")
    }
    assert (ratios["convex"] > 1.05).all()
    np.testing.assert_allclose(ratios["exponential"], 1, rtol=1e-5)
    assert (ratios["concave"] < 0.95).all()
