"""Assimilation and windows of generations."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.estimands.questions import estimate
from baldwinlab.analysis.estimands.traits import measure_assimilation, split_ends
from tests.analysis.estimands.conftest import Stored


def distances(*by_run: list[float]) -> xr.DataArray:
    values = np.array(by_run)
    coords = {"generation": np.arange(values.shape[1])}
    return xr.DataArray(values, coords, dims=("run", "generation"))


def test_assimilation_is_the_share_of_the_distance_that_is_gone() -> None:
    measured = measure_assimilation(distances([4, 3, 2, 1], [4, 4, 4, 4], [2, 2, 5, 0], [0] * 4), 1)
    np.testing.assert_allclose(measured, [0.75, 0, 1, np.nan])


def test_windows_are_means_and_do_not_overlap() -> None:
    first, final = split_ends(distances([1, 2, 3, 4, 5]), 10)
    assert first["generation"].values.tolist() == [0, 1]
    assert final["generation"].values.tolist() == [3, 4]


@pytest.mark.nightly
def test_assimilation_does_not_change_if_a_constant_is_added_to_fitness(
    stored: dict[str, Stored],
) -> None:
    data = stored["costly-climbing/rugged"]
    shifted = data.innate.assign(energy=data.innate["energy"] + 5)
    original, changed = (
        {row.question: row for row in estimate(data.runs, {"innate": innate}, data.experiment, 5)}
        for innate in (data.innate, shifted)
    )
    a, b = (rows["assimilation"].values for rows in (original, changed))
    assert a is not None
    xr.testing.assert_identical(a, b)
    assert float(a.median()) > 0.2


def test_the_share_of_undefined_alleles_that_is_gone(stored: dict[str, Stored]) -> None:
    data = stored["guessing"]
    rows = estimate(data.runs, {"innate": data.innate}, data.experiment, 2)
    (row,) = [row for row in rows if row.question == "assimilation"]
    assert row.trait == "share of alleles that are ?"
    unset = data.runs["unset"].mean("agent").astype(np.float64)
    first, final = unset[:, :2].mean("generation"), unset[:, -2:].mean("generation")
    assert row.values is not None
    assert row.values.values == pytest.approx((1 - final / first).values, rel=1e-5)
