"""Conversion of datasets and arrays to netCDF 3 with a checksum, which detects changed bytes.

`encode_netcdf` (version 3 with 64-bit offsets) needs only NumPy, because the import of xarray and
SciPy takes longer than the simulation of a short run. The function returns the same bytes as xarray
with SciPy.

References
----------
NetCDF Classic Format Specification, https://docs.unidata.ucar.edu/netcdf-c/current/file_format_specifications.html
"""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import import_netcdf_reader, xr
from baldwinlab.core.errors import BaldwinLabError

# The checksum is within this number of bytes at the beginning of a file.
CHECKSUM_BYTES: Final = 65536
_BLANK_CHECKSUM = "0" * 64
# A netCDF attribute is a name, a type and a length of four bytes each, and a value.
_CHECKSUM_PATTERN = re.compile(rb"checksum.{8}([0-9a-f]{64})", re.DOTALL)
_MAGIC: Final = b"CDF\x02"
_ABSENT: Final = bytes(8)
_DIMENSIONS, _VARIABLES, _ATTRIBUTES = 10, 11, 12
# NumPy type: the code of the type in a file, and the value that fills the data to four bytes.
_TYPES: Final = {
    "i1": (1, b"\x81"),
    "S1": (2, b"\x00"),
    "i2": (3, b"\x80\x01"),
    "i4": (4, b""),
    "f4": (5, b""),
    "f8": (6, b""),
}
# NumPy type that a file cannot contain: the type to which the values are converted.
_NARROW_TYPES: Final = {"i8": "i4", "u8": "i4", "u4": "i4", "u2": "i2", "u1": "i1", "b1": "i1"}


class DamagedError(BaldwinLabError):
    """Changed or invalid bytes. The message is a clause, such as "it carries no checksum"."""


class LabeledArray(NamedTuple):
    """Values with a name for each dimension, and attributes."""

    dims: tuple[str, ...]
    values: Any
    attributes: Mapping[str, Any] = {}


def to_bytes(data: xr.Dataset) -> bytes:
    """Return a dataset as netCDF with a checksum: see `encode_arrays`."""
    # `Dataset.to_netcdf` imports Dask, which takes a second.
    stream = io.BytesIO()
    store = xr.backends.ScipyDataStore(stream, mode="w")
    data.assign_attrs(checksum=_BLANK_CHECKSUM).dump_to_store(store)
    store.sync()
    return bytes(_insert_checksum(bytearray(stream.getvalue())))


def encode_arrays(
    variables: Mapping[str, LabeledArray], attributes: Mapping[str, Any]
) -> bytearray:
    """Return arrays as netCDF with a checksum.

    The checksum is the SHA-256 of the bytes with zeros in place of the checksum.
    """
    return _insert_checksum(encode_netcdf(variables, {**attributes, "checksum": _BLANK_CHECKSUM}))


def _insert_checksum(raw: bytearray) -> bytearray:
    """Replace the blank checksum in `raw`, and return `raw`."""
    start = raw.index(_BLANK_CHECKSUM.encode())
    raw[start : start + len(_BLANK_CHECKSUM)] = hashlib.sha256(raw).hexdigest().encode()
    return raw


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
    """Return the checksum in the first bytes of a file, not verified, or ""."""
    match = _CHECKSUM_PATTERN.search(head)
    return match.group(1).decode() if match else ""


def decode_variables(raw: bytes) -> tuple[dict[str, Any], dict[Hashable, xr.Variable]]:
    """Return the attributes and the variables as they are stored, without decoding.

    For a small file, this is much faster than `from_bytes`. Raises the same DamagedError.
    """
    _require_no_rows(raw)
    import_netcdf_reader()
    # Imported late: few commands read files in this way, and the import takes half a second.
    from scipy.io import netcdf_file

    with _report_damage():
        file = netcdf_file(io.BytesIO(raw), mmap=False)
        attributes = _decode_attributes(file)
        variables: dict[Hashable, xr.Variable] = {
            name: xr.Variable(variable.dimensions, variable.data, _decode_attributes(variable))
            for name, variable in file.variables.items()
        }
    attributes.pop("checksum", None)
    return attributes, variables


@contextmanager
def _report_damage() -> Iterator[None]:
    """Raise DamagedError for an error of a reader, which raises any kind for invalid bytes."""
    try:
        yield
    # These errors are those of the installation and of the machine, and not of the file.
    except (ImportError, MemoryError):
        raise
    except Exception as error:
        raise DamagedError(f"it is no netCDF file ({type(error).__name__})") from None


def _decode_attributes(owner: Any) -> dict[str, Any]:
    """Return the attributes of a netCDF file or variable."""
    values = vars(owner)["_attributes"].items()
    return {name: value.decode() if isinstance(value, bytes) else value for name, value in values}


def from_bytes(raw: bytes) -> xr.Dataset:
    """Return the dataset in netCDF bytes without the checksum, with text coordinates as str.

    Raises DamagedError for bytes that are not netCDF.
    """
    _require_no_rows(raw)
    import_netcdf_reader()
    with _report_damage():
        data = xr.load_dataset(io.BytesIO(raw), engine="scipy")
        # Texts are read as objects (kind "O") or as bytes (kind "S").
        texts = {
            name: data[name].astype(str) for name in data.coords if data[name].dtype.kind in "OS"
        }
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


def encode_netcdf(
    variables: Mapping[str, LabeledArray], attributes: Mapping[str, Any]
) -> bytearray:
    """Return a netCDF file of arrays.

    Raises `ValueError` if an integer does not fit into 32 bits.
    """
    encoded = {name: _encode_variable(variable) for name, variable in variables.items()}
    sizes: dict[str, int] = {}
    for variable in encoded.values():
        sizes |= dict(zip(variable.dims, variable.values.shape, strict=True))
    dim_ids = {name: index for index, name in enumerate(sizes)}
    # SciPy sorts the variables by shape in descending order.
    names = sorted(encoded, key=lambda name: encoded[name].values.shape, reverse=True)
    dimensions = [_pack_text(name) + _pack_int(size) for name, size in sizes.items()]
    head = _MAGIC + _pack_int(0) + _pack_list(_DIMENSIONS, dimensions)
    head += _pack_attributes(attributes)
    headers = [_pack_header(name, encoded[name], dim_ids) for name in names]
    offset_bytes = 8
    # The list of the headers begins with 8 bytes, and an offset follows each header.
    end = len(head) + 8 + sum(len(header) + offset_bytes for header in headers)
    starts = []
    for name in names:
        starts.append(end)
        end += _count_bytes(encoded[name].values)
    entries = [
        header + start.to_bytes(offset_bytes, "big")
        for header, start in zip(headers, starts, strict=True)
    ]
    head += _pack_list(_VARIABLES, entries)
    # One array for the complete file avoids copies of large variables.
    raw = bytearray(end if entries else len(head))
    raw[: len(head)] = head
    for name, start in zip(names, starts, strict=True):
        _pack_data(encoded[name].values, memoryview(raw)[start:])
    return raw


def _encode_variable(variable: LabeledArray) -> LabeledArray:
    """Convert a variable to a type of the file format, and add the attributes that xarray adds."""
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
    """Convert values to a type of the file format. Raises ValueError if a value does not fit."""
    narrow_type = _NARROW_TYPES.get(values.dtype.str[1:])
    if narrow_type is None:
        return values
    narrow = values.astype(narrow_type)
    if not np.array_equal(narrow, values):
        raise ValueError(f"a netCDF file cannot store {values.dtype} as {narrow.dtype}")
    return narrow


def _pack_header(name: str, variable: LabeledArray, dim_ids: Mapping[str, int]) -> bytes:
    """Return the description of a variable in a file, without the offset of the data."""
    dims = b"".join(_pack_int(dim_ids[dim]) for dim in variable.dims)
    type_number, _ = _TYPES[variable.values.dtype.str[1:]]
    return b"".join(
        [
            _pack_text(name),
            _pack_int(len(variable.dims)),
            dims,
            _pack_attributes(variable.attributes),
            _pack_int(type_number),
            _pack_int(_count_bytes(variable.values)),
        ]
    )


def _count_bytes(values: npt.NDArray[Any]) -> int:
    """Return the size of a variable in a file, a multiple of four."""
    return values.nbytes + -values.nbytes % 4


def _pack_data(values: npt.NDArray[Any], raw: memoryview) -> None:
    """Write values in the byte order of a file at the start of `raw`, and fill the last word."""
    stored = np.frombuffer(raw, values.dtype.newbyteorder(">"), values.size)
    stored.reshape(values.shape)[...] = values
    _, fill = _TYPES[values.dtype.str[1:]]
    n_missing = -values.nbytes % 4
    raw[values.nbytes : values.nbytes + n_missing] = fill * (n_missing // max(1, len(fill)))


def _pack_attributes(attributes: Mapping[str, Any]) -> bytes:
    return _pack_list(
        _ATTRIBUTES, [_pack_text(name) + _pack_value(value) for name, value in attributes.items()]
    )


def _pack_value(value: Any) -> bytes:
    """Return the bytes of a text or of numbers as the value of an attribute."""
    if isinstance(value, str):
        # SciPy writes an empty text as one zero.
        return _pack_int(_TYPES["S1"][0]) + _pack_text(value or "\0")
    values = _narrow(np.atleast_1d(value))
    raw = values.astype(values.dtype.newbyteorder(">")).tobytes()
    head = _pack_int(_TYPES[values.dtype.str[1:]][0]) + _pack_int(values.size)
    return head + raw + bytes(-len(raw) % 4)


def _pack_list(tag: int, entries: list[bytes]) -> bytes:
    """Return the bytes of a list: tag, number of entries, and the entries."""
    if not entries:
        return _ABSENT
    return b"".join([_pack_int(tag), _pack_int(len(entries)), *entries])


def _pack_text(text: str) -> bytes:
    raw = text.encode()
    return _pack_int(len(raw)) + raw + bytes(-len(raw) % 4)


def _pack_int(number: int) -> bytes:
    # A larger number, such as the size of data of 4 GiB, is written as the largest number.
    return min(number, 2**32 - 1).to_bytes(4, "big")
