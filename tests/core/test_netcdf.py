"""A dataset is read from its file unchanged, and a changed bit is detected."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from baldwinlab.core.netcdf import DamagedError, from_bytes, to_bytes, verify_checksum
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
