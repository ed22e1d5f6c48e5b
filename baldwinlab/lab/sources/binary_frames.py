"""Binary containers for the page: a JSON header and typed arrays that browsers read without a copy.

    b"BALD", size of the header as uint32, header as UTF-8 JSON padded with spaces, padded arrays

All numbers are little-endian. The data and each array begin at a multiple of 8 bytes. An array that
changes little from row to row can be stored as differences. Differences compress better: the
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
# In a browser, a typed array must begin at a multiple of its item size. 8 fits all types.
_ALIGNMENT_BYTES = 8
# Size of the uint32 that contains the size of the header.
_SIZE_BYTES = 4


def pack(
    header: Mapping[str, Any],
    arrays: Mapping[str, npt.NDArray[Any]],
    differences: Collection[str] = (),
) -> bytes:
    """Return the container of a header and named arrays.

    The stored header also has `arrays`: the name, type, shape and offset of each array. Offsets are
    in bytes from the beginning of the data. `differences`: names of arrays [row, column] that are
    stored column by column, each value as the difference from the value in the row above. The
    subtraction uses the bits of a value as an integer, so that it is exact.
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
    return -n_bytes % _ALIGNMENT_BYTES


def _subtract_rows(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the difference of each row of an array [row, column] from the previous row.

    The result is [column, row]. The differences are unsigned and wrap around. The first row is
    unchanged.
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
