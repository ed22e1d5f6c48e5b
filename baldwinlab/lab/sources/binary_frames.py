"""Binary containers for the page: a JSON header and typed arrays that browsers read without a copy.

    b"BALD", uint32: bytes of the header, header as UTF-8 JSON padded with spaces, padded arrays

All numbers are little-endian. The data and each array begin at a multiple of 8 bytes. An array that
changes little from row to row can be stored as differences, which compress to about a tenth: the
positions of twenty agents in a lifetime need 30 kB instead of 450 kB.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

MAGIC = b"BALD"
DTYPES = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float32")
# A typed array of any of these types may begin at a multiple of this number of bytes.
_ALIGNMENT_BYTES = 8
# The number that states the size of the header.
_SIZE_BYTES = 4


def pack(
    header: Mapping[str, Any],
    arrays: Mapping[str, npt.NDArray[Any]],
    differences: Collection[str] = (),
) -> bytes:
    """Return the container of a header and named arrays.

    `header`: `header["arrays"]` becomes the list of names, types, shapes and offsets of the arrays.
    Offsets are in bytes from the beginning of the data. `differences`: [row, column] that are
    stored column by column, each value as the exact difference from the value above it. The bits
    are subtracted, not the floating-point numbers.
    """
    entries: list[dict[str, Any]] = []
    chunks = []
    offset = 0
    for name, array in arrays.items():
        if array.dtype.name not in DTYPES:
            raise ValueError(
                f"array {name} is of type {array.dtype}; it must be one of {', '.join(DTYPES)}"
            )
        entries.append(
            {"name": name, "dtype": array.dtype.name, "shape": list(array.shape), "offset": offset}
        )
        ordered = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
        if name in differences:
            entries[-1]["differences"] = True
            ordered = _subtract_rows(ordered)
        raw = ordered.tobytes()
        padding = bytes(_count_padding(len(raw)))
        chunks += [raw, padding]
        offset += len(raw) + len(padding)
    text = json.dumps({**header, "arrays": entries}, allow_nan=False).encode()
    # The data begins at a multiple of the alignment.
    text += b" " * _count_padding(len(MAGIC) + _SIZE_BYTES + len(text))
    return b"".join([MAGIC, len(text).to_bytes(_SIZE_BYTES, "little"), text, *chunks])


def _count_padding(n_bytes: int) -> int:
    """Return the number of bytes up to the next multiple of the alignment."""
    return -n_bytes % _ALIGNMENT_BYTES


def _subtract_rows(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the difference of each row of an array [row, column] from the row above it.

    The result is [column, row]. The differences are unsigned and wrap around.
    """
    bits = array.view(f"<u{array.itemsize}").T
    return np.diff(bits, axis=1, prepend=bits.dtype.type(0))


def narrow(counts: npt.NDArray[np.uint32]) -> npt.NDArray[Any]:
    """Return counts as uint16 if all values fit, else unchanged."""
    fits_in_uint16 = counts.max(initial=0) <= np.iinfo(np.uint16).max
    return counts.astype(np.uint16) if fits_in_uint16 else counts


def unpack(raw: bytes) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """Return the header and the arrays of a container."""
    if raw[: len(MAGIC)] != MAGIC:
        raise ValueError("these bytes are not a container: they do not begin with BALD")
    header_start = len(MAGIC) + _SIZE_BYTES
    header_size = int.from_bytes(raw[len(MAGIC) : header_start], "little")
    data_start = header_start + header_size
    header = json.loads(raw[header_start:data_start])
    arrays = {}
    for entry in header["arrays"]:
        dtype = np.dtype(entry["dtype"]).newbyteorder("<")
        shape = tuple(entry["shape"])
        n_values = int(np.prod(shape, dtype=np.int64))
        array = np.frombuffer(raw, dtype, n_values, data_start + entry["offset"])
        if entry.get("differences"):
            # Differences are stored as [column, row].
            differences = array.view(f"<u{dtype.itemsize}").reshape(shape[::-1])
            bits = np.cumsum(differences, axis=1, dtype=differences.dtype)
            array = bits.T.copy().view(dtype)
        arrays[entry["name"]] = array.reshape(shape)
    return header, arrays
