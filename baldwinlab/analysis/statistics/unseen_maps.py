"""Fitness on unseen maps: one value per run, from the stored assay."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

VARIABLE = "unseen maps"
"""Name of the variable in the dataset of a study."""


def add_unseen_maps(data: xr.Dataset, assays: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Add the mean fitness on unseen maps to the runs of a study.

    Parameters
    ----------
    data : xr.Dataset
        The runs, with the dimensions (condition, run, generation, agent).
    assays : mapping of str to xr.Dataset
        The stored assay `unseen-maps` by condition.

    Returns
    -------
    xr.Dataset
        The runs, with the variable `VARIABLE` (condition, run). It is NaN without an assay. The
        dataset is unchanged if no assay is stored.
    """
    if not assays:
        return data
    values = _make_undefined(data)
    for condition, assay in assays.items():
        means = assay["energy"].mean("map")
        values.loc[{"condition": condition, "run": means["run"].values}] = means.values
    return data.assign({VARIABLE: values})


def get_unseen_maps(data: xr.Dataset) -> xr.DataArray:
    """Return the mean fitness on unseen maps.

    Parameters
    ----------
    data : xr.Dataset
        The runs of a study.

    Returns
    -------
    xr.DataArray
        Fitness (condition, run); NaN without the assay.
    """
    return data[VARIABLE] if VARIABLE in data else _make_undefined(data)


def _make_undefined(data: xr.Dataset) -> xr.DataArray:
    """Return an array (condition, run) of NaN."""
    shape = (data.sizes["condition"], data.sizes["run"])
    coordinates = {"condition": data["condition"].values, "run": data["run"].values}
    return xr.DataArray(np.full(shape, np.nan), coordinates)
