"""A writer of netCDF files (version 3 with 64-bit offsets) that needs only NumPy.

The first record of a study is written without the import of xarray and SciPy, which takes longer
than the simulation of a short run. The bytes are those of xarray with SciPy.

References
----------
NetCDF Classic Format Specification, https://docs.unidata.ucar.edu/netcdf-c/current/file_format_specifications.html
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

_MAGIC: Final = b"CDF\x02"
_ABSENT: Final = bytes(8)
_DIMENSIONS, _VARIABLES, _ATTRIBUTES = 10, 11, 12
# The number of a type in a file, and the value that fills four bytes.
_TYPES: Final = {
    "i1": (1, b"\x81"),
    "S1": (2, b"\x00"),
    "i2": (3, b"\x80\x01"),
    "i4": (4, b""),
    "f4": (5, b""),
    "f8": (6, b""),
}
# Types of arrays that a file cannot contain, and the types of their values in a file.
_NARROW_TYPES: Final = {"i8": "i4", "u8": "i4", "u4": "i4", "u2": "i2", "u1": "i1", "b1": "i1"}


class LabeledArray(NamedTuple):
    """Values with a name for each dimension, and attributes."""

    dims: tuple[str, ...]
    values: Any
    attributes: Mapping[str, Any] = {}


def encode_netcdf(variables: Mapping[str, LabeledArray], attributes: Mapping[str, Any]) -> bytes:
    """Return a netCDF file of arrays.

    Raises `ValueError` if an integer does not fit into 32 bits.
    """
    encoded = {name: _encode_variable(variable) for name, variable in variables.items()}
    sizes: dict[str, int] = {}
    for variable in encoded.values():
        sizes |= dict(zip(variable.dims, variable.values.shape, strict=True))
    dim_ids = {name: index for index, name in enumerate(sizes)}
    # SciPy writes the variables in this order.
    names = sorted(encoded, key=lambda name: encoded[name].values.shape, reverse=True)
    dimensions = [_pack_text(name) + _pack_int(size) for name, size in sizes.items()]
    head = _MAGIC + _pack_int(0) + _pack_list(_DIMENSIONS, dimensions)
    head += _pack_attributes(attributes)
    chunks = [_pack_data(encoded[name].values) for name in names]
    headers = [_pack_header(name, encoded[name], dim_ids) for name in names]
    offset_bytes = 8
    # A list begins with its tag and its length.
    start = len(head) + 8 + sum(len(header) + offset_bytes for header in headers)
    entries = []
    for header, chunk in zip(headers, chunks, strict=True):
        entries.append(header + start.to_bytes(offset_bytes, "big"))
        start += len(chunk)
    return b"".join([head, _pack_list(_VARIABLES, entries), *chunks])


def _encode_variable(variable: LabeledArray) -> LabeledArray:
    """Return a variable with a type of a file, and with the attributes that xarray adds."""
    values = np.asarray(variable.values)
    attributes = dict(variable.attributes)
    if values.dtype.kind == "U":
        values = np.char.encode(values, "utf-8")
        length = max(1, values.dtype.itemsize)
        characters = np.ascontiguousarray(values, f"S{length}")
        characters = characters.view("S1").reshape(*values.shape, length)
        dims = (*variable.dims, f"string{length}")
        return LabeledArray(dims, characters, {"_Encoding": "utf-8"} | attributes)
    if values.dtype.kind == "f":
        attributes["_FillValue"] = values.dtype.type(np.nan)
    if values.dtype.kind == "b":
        attributes["dtype"] = "bool"
    return LabeledArray(variable.dims, _narrow(values), attributes)


def _narrow(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return integers in a type of a file. Raises ValueError if they do not fit into it."""
    narrow_type = _NARROW_TYPES.get(values.dtype.str[1:])
    if narrow_type is None:
        return values
    narrow = values.astype(narrow_type)
    if not np.array_equal(narrow, values):
        raise ValueError(f"a netCDF file cannot store {values.dtype} as {narrow.dtype}")
    return narrow


def _pack_header(name: str, variable: LabeledArray, dim_ids: Mapping[str, int]) -> bytes:
    """Return the description of a variable in a file, without the position of its data."""
    dims = b"".join(_pack_int(dim_ids[dim]) for dim in variable.dims)
    type_number, _ = _TYPES[variable.values.dtype.str[1:]]
    size = variable.values.nbytes
    return b"".join(
        [
            _pack_text(name),
            _pack_int(len(variable.dims)),
            dims,
            _pack_attributes(variable.attributes),
            _pack_int(type_number),
            _pack_int(size + -size % 4),
        ]
    )


def _pack_data(values: npt.NDArray[Any]) -> bytes:
    """Return values in the byte order of a file, filled to four bytes."""
    kind = values.dtype.str[1:]
    raw = values.astype(values.dtype.newbyteorder(">"), copy=False).tobytes()
    _, fill = _TYPES[kind]
    missing_bytes = -len(raw) % 4
    return raw + fill * (missing_bytes // max(1, len(fill)))


def _pack_attributes(attributes: Mapping[str, Any]) -> bytes:
    return _pack_list(
        _ATTRIBUTES, [_pack_text(name) + _pack_value(value) for name, value in attributes.items()]
    )


def _pack_value(value: Any) -> bytes:
    """Return a text or numbers as the value of an attribute."""
    if isinstance(value, str):
        # SciPy writes an empty text as one zero.
        return _pack_int(_TYPES["S1"][0]) + _pack_text(value or "\0")
    values = _narrow(np.atleast_1d(value))
    raw = values.astype(values.dtype.newbyteorder(">")).tobytes()
    head = _pack_int(_TYPES[values.dtype.str[1:]][0]) + _pack_int(values.size)
    return head + raw + bytes(-len(raw) % 4)


def _pack_list(tag: int, entries: list[bytes]) -> bytes:
    """Return a list with its tag and its length."""
    if not entries:
        return _ABSENT
    return b"".join([_pack_int(tag), _pack_int(len(entries)), *entries])


def _pack_text(text: str) -> bytes:
    raw = text.encode()
    return _pack_int(len(raw)) + raw + bytes(-len(raw) % 4)


def _pack_int(number: int) -> bytes:
    # The size of data of 4 GiB and more is written as the largest number.
    return min(number, 2**32 - 1).to_bytes(4, "big")
