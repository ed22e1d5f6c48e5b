"""Fitness on unseen maps: one value per run, from the stored assay."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

VARIABLE = "unseen maps"
"""Name of the variable in the dataset of a study."""


def add_unseen_maps(data: xr.Dataset, assays: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Add the mean fitness on unseen maps, from the assay of that name by condition, to the runs.

    `VARIABLE` (condition, run) is NaN without an assay. The dataset is unchanged if no assay is
    stored.
    """
    if not assays:
        return data
    values = _make_undefined(data)
    for condition, assay in assays.items():
        means = assay["energy"].mean("map")
        values.loc[{"condition": condition, "run": means["run"].values}] = means.values
    return data.assign({VARIABLE: values})


def get_unseen_maps(data: xr.Dataset) -> xr.DataArray:
    """Return the mean fitness on unseen maps (condition, run); NaN without the assay."""
    return data[VARIABLE] if VARIABLE in data else _make_undefined(data)


def _make_undefined(data: xr.Dataset) -> xr.DataArray:
    """Return an array (condition, run) of NaN."""
    shape = (data.sizes["condition"], data.sizes["run"])
    coordinates = {"condition": data["condition"].values, "run": data["run"].values}
    return xr.DataArray(np.full(shape, np.nan), coordinates)
