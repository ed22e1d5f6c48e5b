"""Frames on their way to the page: a small JSON header, then typed arrays that a browser can look into without copying.

    b"BALD", uint32: bytes of the header, header as UTF-8 JSON padded with spaces, arrays each padded with zeros

Everything is little-endian; the arrays begin at a multiple of 8 bytes, and so does each of them. An array that changes
little from row to row can lie there as differences, which deflate to a tenth of its size: of where twenty agents are in a
life, 450 kB become 30.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

MAGIC = b"BALD"
DTYPES = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float32")
_ALIGNED = 8  # bytes, to which a typed array of any of these types may begin


def pack(
    header: Mapping[str, Any],
    arrays: Mapping[str, npt.NDArray[Any]],
    differences: Collection[str] = (),
) -> bytes:
    """The container of a header and named arrays, whose names, types, shapes and offsets become header["arrays"].

    An offset is in bytes from the beginning of the data. Arrays [row, column] that are named in `differences` are kept column by
    column, each number less the one above it, exactly: bits are subtracted, not floats. Raises ValueError for an array of any
    other type than `DTYPES`.
    """
    listed: list[dict[str, Any]] = []
    chunks, offset = [], 0
    for name, array in arrays.items():
        if array.dtype.name not in DTYPES:
            raise ValueError(
                f"array {name} is of type {array.dtype}; it must be one of {', '.join(DTYPES)}"
            )
        listed.append(
            {"name": name, "dtype": array.dtype.name, "shape": list(array.shape), "offset": offset}
        )
        ordered = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
        if name in differences:
            listed[-1]["differences"] = True
            ordered = _differences(ordered)
        raw = ordered.tobytes()
        chunks += [raw, bytes(-len(raw) % _ALIGNED)]
        offset += len(raw) + len(chunks[-1])
    text = json.dumps({**header, "arrays": listed}, allow_nan=False).encode()
    text += b" " * (-(len(MAGIC) + 4 + len(text)) % _ALIGNED)
    return b"".join([MAGIC, len(text).to_bytes(4, "little"), text, *chunks])


def _differences(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """[row, column] as [column, row] of unsigned numbers, each less the one before it, modulo their size."""
    bits = array.view(f"<u{array.itemsize}").T
    return np.diff(bits, axis=1, prepend=bits.dtype.type(0))


def narrowed(counts: npt.NDArray[np.uint32]) -> npt.NDArray[Any]:
    """Counts in 16 bits, where all of them fit."""
    return counts.astype(np.uint16) if counts.max(initial=0) < 2**16 else counts


def unpack(raw: bytes) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """The header and the arrays in a container, as the page reads it. Raises ValueError where `raw` is none."""
    if raw[: len(MAGIC)] != MAGIC:
        raise ValueError("these bytes are no container: they do not begin with BALD")
    begin = len(MAGIC) + 4
    end = begin + int.from_bytes(raw[len(MAGIC) : begin], "little")
    header = json.loads(raw[begin:end])
    arrays = {}
    for entry in header["arrays"]:
        dtype, shape = np.dtype(entry["dtype"]).newbyteorder("<"), tuple(entry["shape"])
        count = int(np.prod(shape, dtype=np.int64))
        array = np.frombuffer(raw, dtype, count, end + entry["offset"])
        if entry.get("differences"):
            bits = array.view(f"<u{dtype.itemsize}").reshape(shape[::-1])
            array = np.cumsum(bits, axis=1, dtype=bits.dtype).T.copy().view(dtype)
        arrays[entry["name"]] = array.reshape(shape)
    return header, arrays
