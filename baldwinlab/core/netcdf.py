"""Datasets as netCDF 3 with a checksum of the whole: any netCDF tool reads them, and a bit that has changed is noticed."""

from __future__ import annotations

import hashlib
import io
import re
from typing import Any

import xarray as xr
from xarray.backends import ScipyDataStore

from baldwinlab.core.errors import BaldwinLabError

_BLANK = "0" * 64
_CHECKSUM = re.compile(
    rb"checksum.{8}([0-9a-f]{64})", re.DOTALL
)  # a netCDF attribute: name, type, length, value


class DamagedError(BaldwinLabError):
    """Bytes that are not what was written; the text says why, in part of a sentence."""


def to_bytes(data: xr.Dataset) -> bytes:
    """A dataset as netCDF with a checksum: the SHA-256 of itself with the checksum blank."""
    raw = bytes(data.assign_attrs(checksum=_BLANK).to_netcdf(engine="scipy"))
    return raw.replace(_BLANK.encode(), hashlib.sha256(raw).hexdigest().encode(), 1)


def verify(raw: bytes) -> None:
    """Raises DamagedError unless these are the bytes that `sealed` gave."""
    found = _CHECKSUM.search(raw)
    if found is None:
        raise DamagedError("it carries no checksum")
    whole, digest = (
        memoryview(raw),
        hashlib.sha256(),
    )  # not put together anew, as a record may have many megabytes
    for piece in (whole[: found.start(1)], _BLANK.encode(), whole[found.end(1) :]):
        digest.update(piece)
    if digest.hexdigest().encode() != found.group(1):
        raise DamagedError("its checksum does not fit its content")


def stored_checksum(head: bytes) -> str:
    """The checksum that a file carries, of its first bytes alone and not verified; "" where there is none among these."""
    found = _CHECKSUM.search(head)
    return found.group(1).decode() if found else ""


def attributes(raw: bytes) -> dict[str, Any]:
    """What a dataset says of itself, without decoding its arrays and its checksum. Raises DamagedError as `opened` does."""
    _require_no_rows(raw)
    try:
        found = dict(ScipyDataStore(io.BytesIO(raw)).get_attrs())
    except Exception as error:  # see `opened`
        raise DamagedError(f"it is no netCDF file ({type(error).__name__})") from None
    found.pop("checksum", None)
    return found


def from_bytes(raw: bytes) -> xr.Dataset:
    """A dataset whose coordinates of text are text again, without its checksum. Raises DamagedError for other bytes."""
    _require_no_rows(raw)
    try:
        found = xr.load_dataset(io.BytesIO(raw), engine="scipy")
        texts = {
            name: found[name].astype(str) for name in found.coords if found[name].dtype.kind in "OS"
        }
    except Exception as error:  # whatever a reader meets in bytes that are no netCDF
        raise DamagedError(f"it is no netCDF file ({type(error).__name__})") from None
    found.attrs.pop("checksum", None)
    return found.assign_coords(texts)


def _require_no_rows(raw: bytes) -> None:
    """Raise DamagedError where the header counts rows of an unlimited dimension, which no dataset here has."""
    if raw[4:8].strip(b"\0"):
        raise DamagedError(
            "it is no netCDF file of baldwinlab: its header counts rows of an unlimited dimension"
        )
