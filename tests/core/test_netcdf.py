"""A dataset is read from its file unchanged, and a changed bit is detected."""

from __future__ import annotations

import io
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import xarray as xr

from baldwinlab.core.netcdf import (
    DamagedError,
    LabeledArray,
    decode_variables,
    encode_netcdf,
    from_bytes,
    to_bytes,
    verify_checksum,
)
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.records import encode_record
from tests.small_studies import shorten_preset


def test_a_dataset_is_read_from_its_bytes_unchanged() -> None:
    data = xr.Dataset(
        {"height": ("person", np.arange(2.0))}, {"person": ["Ada", "B\u00e9la"]}, {"seed": 3}
    )
    raw = to_bytes(data)
    verify_checksum(raw)
    xr.testing.assert_identical(from_bytes(raw).assign_attrs(seed=3), data)


def test_a_change_of_any_byte_of_a_record_is_detected() -> None:
    raw = encode_record(simulate(shorten_preset("evo/A"), seed=1))
    rng = np.random.default_rng(0)
    for position in [0, 3, len(raw) - 1, *rng.integers(0, len(raw), 200)]:
        damaged = bytearray(raw)
        damaged[position] ^= 1 << rng.integers(8)
        with pytest.raises(DamagedError):
            verify_checksum(bytes(damaged))
    for length in (0, 10, len(raw) // 2, len(raw) - 1):
        with pytest.raises(DamagedError):
            verify_checksum(raw[:length])


@pytest.mark.parametrize("raw", [b"", b"CDF", b"nothing of the kind", b"CDF\x01" + b"\xff" * 400])
def test_bytes_that_are_not_netcdf_are_refused(raw: bytes) -> None:
    with pytest.raises(DamagedError, match="it is no netCDF file"):
        from_bytes(raw)


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


def test_an_integer_of_more_than_32_bits_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot store int64 as int32"):
        encode_netcdf({"x": LabeledArray(("i",), np.array([2**40]))}, {})


@pytest.mark.parametrize("error", [ImportError, MemoryError])
def test_an_error_of_the_machine_is_no_damaged_file(error: type[Exception]) -> None:
    raw = to_bytes(xr.Dataset({"height": ("person", np.arange(2.0))}))
    with patch.object(xr, "load_dataset", side_effect=error), pytest.raises(error):
        from_bytes(raw)
    with patch("scipy.io.netcdf_file", side_effect=error), pytest.raises(error):
        decode_variables(raw)
