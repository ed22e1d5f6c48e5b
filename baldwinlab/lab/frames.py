"""Frames on their way to the page: a small JSON header, then typed arrays that a browser can look into without copying.

    b"BALD", uint32: bytes of the header, header as UTF-8 JSON padded with spaces, arrays each padded with zeros

Everything is little-endian; the arrays begin at a multiple of 8 bytes, and so does each of them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

MAGIC = b"BALD"
DTYPES = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float32")
_ALIGNED = 8  # bytes, to which a typed array of any of these types may begin


def pack(header: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """The container of a header and named arrays, whose names, types, shapes and offsets become header["arrays"].

    An offset is in bytes from the beginning of the data. Raises ValueError for an array of any other type than `DTYPES`.
    """
    listed, chunks, offset = [], [], 0
    for name, array in arrays.items():
        if array.dtype.name not in DTYPES:
            raise ValueError(f"array {name} is of type {array.dtype}; it must be one of {', '.join(DTYPES)}")
        raw = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
        listed.append({"name": name, "dtype": array.dtype.name, "shape": list(array.shape), "offset": offset})
        chunks += [raw, bytes(-len(raw) % _ALIGNED)]
        offset += len(raw) + len(chunks[-1])
    text = json.dumps({**header, "arrays": listed}, allow_nan=False).encode()
    text += b" " * (-(len(MAGIC) + 4 + len(text)) % _ALIGNED)
    return b"".join([MAGIC, len(text).to_bytes(4, "little"), text, *chunks])


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
        arrays[entry["name"]] = np.frombuffer(raw, dtype, count, end + entry["offset"]).reshape(shape)
    return header, arrays
