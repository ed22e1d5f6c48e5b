"""Test the writer of netCDF files against xarray with SciPy."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.core.netcdf_writer import LabeledArray, encode_netcdf


def to_dataset(variables: dict[str, LabeledArray], attributes: dict[str, Any]) -> xr.Dataset:
    coordinates = {name: value for name, value in variables.items() if value.dims == (name,)}
    data = {name: value for name, value in variables.items() if name not in coordinates}
    return xr.Dataset(data, coordinates, attributes)[list(variables)]


VARIABLES = {
    "energy": LabeledArray(
        ("run", "generation", "agent"),
        np.random.default_rng(1).random((2, 3, 5)),
        {"units": "items", "long_name": "energy of an agent"},
    ),
    "genome": LabeledArray(
        ("generation", "agent"), np.array([[0.1] * 5, [np.nan] * 5, [3] * 5], np.float32)
    ),
    "parents": LabeledArray(("generation", "agent"), np.arange(15, dtype=np.int32).reshape(3, 5)),
    "counts": LabeledArray(("agent",), np.arange(5), {"units": "meals"}),
    "is_alive": LabeledArray(("agent",), np.array([True, False, True, True, False])),
    "small": LabeledArray(("generation",), np.array([1, -2, 3], np.int16)),
    "total": LabeledArray((), np.float64(1.5)),
    "reason": LabeledArray(("run",), ["", "target fitness ä"]),
    "run": LabeledArray(("run",), np.array([4, 5], np.int32)),
    "module": LabeledArray(("module",), ["action", "reinforcement"]),
}
ATTRIBUTES = {"seed": 3, "text": "naïve", "empty": "", "rates": np.array([0.5, 1.0])}


def test_bytes_equal_those_of_xarray() -> None:
    expected = bytes(to_dataset(VARIABLES, ATTRIBUTES).to_netcdf(engine="scipy"))
    assert encode_netcdf(VARIABLES, ATTRIBUTES) == expected


def test_a_file_without_content_is_valid() -> None:
    raw = encode_netcdf({}, {})
    assert xr.load_dataset(io.BytesIO(raw), engine="scipy").identical(xr.Dataset())


def test_xarray_reads_the_values() -> None:
    raw = encode_netcdf(VARIABLES, ATTRIBUTES)
    data = xr.load_dataset(io.BytesIO(raw), engine="scipy")
    assert data.attrs["text"] == "naïve"
    assert data.reason.astype(str).values.tolist() == ["", "target fitness ä"]
    for name in ("energy", "genome", "parents", "counts", "small", "total"):
        assert np.array_equal(data[name], VARIABLES[name].values, equal_nan=True)


def test_an_integer_of_more_than_32_bits_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot store int64 as int32"):
        encode_netcdf({"x": LabeledArray(("i",), np.array([2**40]))}, {})
