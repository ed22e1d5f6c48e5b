"""Conversion of datasets to netCDF 3 with a checksum, which detects changed bytes."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Hashable, Mapping
from typing import Any, Final

from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.netcdf_writer import LabeledArray, encode_netcdf

# Number of bytes at the beginning of a file that contain its checksum.
CHECKSUM_BYTES: Final = 65536
_BLANK_CHECKSUM = "0" * 64
# A netCDF attribute consists of name, type, length and value.
_CHECKSUM_PATTERN = re.compile(rb"checksum.{8}([0-9a-f]{64})", re.DOTALL)


class DamagedError(BaldwinLabError):
    """Changed or invalid bytes; the message is a clause that states the reason."""


def to_bytes(data: xr.Dataset) -> bytes:
    """Return a dataset as netCDF with a checksum: see `encode_arrays`."""
    # `Dataset.to_netcdf` imports Dask, which takes a second.
    stream = io.BytesIO()
    store = xr.backends.ScipyDataStore(stream, mode="w")
    data.assign_attrs(checksum=_BLANK_CHECKSUM).dump_to_store(store)
    store.sync()
    return _insert_checksum(stream.getvalue())


def encode_arrays(variables: Mapping[str, LabeledArray], attributes: Mapping[str, Any]) -> bytes:
    """Return arrays as netCDF with a checksum.

    The checksum is the SHA-256 of the bytes with zeros in place of the checksum.
    """
    return _insert_checksum(encode_netcdf(variables, {**attributes, "checksum": _BLANK_CHECKSUM}))


def _insert_checksum(raw: bytes) -> bytes:
    return raw.replace(_BLANK_CHECKSUM.encode(), hashlib.sha256(raw).hexdigest().encode(), 1)


def verify_checksum(raw: bytes) -> None:
    """Raise DamagedError if bytes from `to_bytes` have changed."""
    match = _CHECKSUM_PATTERN.search(raw)
    if match is None:
        raise DamagedError("it carries no checksum")
    # A view avoids a copy of a large record.
    content = memoryview(raw)
    digest = hashlib.sha256()
    digest.update(content[: match.start(1)])
    digest.update(_BLANK_CHECKSUM.encode())
    digest.update(content[match.end(1) :])
    if digest.hexdigest().encode() != match.group(1):
        raise DamagedError("its checksum does not fit its content")


def stored_checksum(head: bytes) -> str:
    """Return the checksum in the first bytes of a file without verification; "" if none exists."""
    match = _CHECKSUM_PATTERN.search(head)
    return match.group(1).decode() if match else ""


def decode_variables(raw: bytes) -> tuple[dict[str, Any], dict[Hashable, xr.Variable]]:
    """Return the attributes and the variables as they are stored, without their decoding.

    This is much faster than `from_bytes` for a small file. Raises DamagedError as `from_bytes`
    does.
    """
    # Few commands read files in this way, and the import takes half a second.
    from scipy.io import netcdf_file

    _require_no_rows(raw)
    try:
        file = netcdf_file(io.BytesIO(raw), mmap=False)
        attributes = _decode_attributes(file)
        variables: dict[Hashable, xr.Variable] = {
            name: xr.Variable(variable.dimensions, variable.data, _decode_attributes(variable))
            for name, variable in file.variables.items()
        }
    # The reader raises any kind of error for invalid bytes.
    except Exception as error:
        raise DamagedError(f"it is no netCDF file ({type(error).__name__})") from None
    attributes.pop("checksum", None)
    return attributes, variables


def _decode_attributes(owner: Any) -> dict[str, Any]:
    """Return the attributes of a netCDF file or variable."""
    values = vars(owner)["_attributes"].items()
    return {name: value.decode() if isinstance(value, bytes) else value for name, value in values}


def from_bytes(raw: bytes) -> xr.Dataset:
    """Return the dataset in netCDF bytes without its checksum, with text coordinates as str.

    Raises DamagedError for bytes that are not netCDF.
    """
    _require_no_rows(raw)
    try:
        data = xr.load_dataset(io.BytesIO(raw), engine="scipy")
        # Texts are read as objects (kind "O") or as bytes (kind "S").
        texts = {
            name: data[name].astype(str) for name in data.coords if data[name].dtype.kind in "OS"
        }
    # The reader raises any kind of error for invalid bytes.
    except Exception as error:
        raise DamagedError(f"it is no netCDF file ({type(error).__name__})") from None
    data.attrs.pop("checksum", None)
    return data.assign_coords(texts)


def _require_no_rows(raw: bytes) -> None:
    """Raise DamagedError for a header with an unlimited dimension: `to_bytes` writes none."""
    # Bytes 4 to 7 of a netCDF 3 file are the number of rows.
    row_count = raw[4:8]
    if row_count.strip(b"\0"):
        raise DamagedError(
            "it is no netCDF file of baldwinlab: its header counts rows of an unlimited dimension"
        )
