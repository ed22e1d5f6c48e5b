"""Tests of the binary container of arrays."""

from __future__ import annotations

import json
import zlib

import numpy as np
import pytest

from baldwinlab.lab.sources.binary_frames import DTYPES, narrow, pack, unpack


def test_unpack_returns_the_packed_header_and_arrays() -> None:
    arrays = {dtype: np.arange(15).astype(dtype).reshape(5, 3) for dtype in DTYPES} | {
        "none": np.empty((0, 2), np.float32)
    }
    header, unpacked = unpack(pack({"kind": "test", "größe": 3}, arrays))
    assert header["kind"] == "test"
    assert header["größe"] == 3
    assert list(unpacked) == list(arrays)
    for name, array in arrays.items():
        assert unpacked[name].dtype == array.dtype
        assert np.array_equal(unpacked[name], array)


def test_row_differences_are_exact_and_compress_well() -> None:
    rng = np.random.default_rng(3)
    steps = np.float32(2) * np.sin(rng.integers(0, 40, (1, 4)).astype(np.float32))
    walk = (
        np.float32(600) + np.cumsum(np.broadcast_to(steps, (3000, 4)), axis=0, dtype=np.float32)
    ) % np.float32(640)
    arrays = {
        "walk": walk,
        "none": walk[:0],
        "bytes": rng.integers(0, 256, (50, 3), np.uint8),
        "counts": np.arange(9)[:, None],
    }
    arrays = {
        name: array.astype(np.int32) if name == "counts" else array
        for name, array in arrays.items()
    }
    raw = pack({}, arrays, differences=arrays)
    for name, array in unpack(raw)[1].items():
        assert array.dtype == arrays[name].dtype
        assert array.tobytes() == arrays[name].tobytes(), name
    assert len(zlib.compress(raw)) < len(zlib.compress(pack({}, arrays))) / 4


@pytest.mark.parametrize("text", ["", "a", "ab", "abcdefg"])
def test_every_array_starts_at_a_multiple_of_eight_bytes(text: str) -> None:
    raw = pack(
        {"text": text}, {"a": np.arange(3, dtype=np.uint8), "b": np.arange(5, dtype=np.float32)}
    )
    length = int.from_bytes(raw[4:8], "little")
    header = json.loads(raw[8 : 8 + length])
    assert raw[:4] == b"BALD"
    assert (8 + length) % 8 == 0
    assert [entry["offset"] for entry in header["arrays"]] == [0, 8]
    assert len(raw) == 8 + length + 8 + 24
    assert raw[8 + length : 8 + length + 8] == bytes([0, 1, 2, 0, 0, 0, 0, 0])


def test_numbers_are_packed_little_endian_in_row_order() -> None:
    array = np.arange(6, dtype=">i4").reshape(2, 3).T
    raw = pack({}, {"a": array})
    assert raw.endswith(np.array([0, 3, 1, 4, 2, 5], "<i4").tobytes())


def test_a_type_without_a_browser_array_is_rejected() -> None:
    with pytest.raises(
        ValueError, match="array a is of type float64; it must be one of int8, uint8"
    ):
        pack({}, {"a": np.zeros(1)})


def test_bytes_of_another_format_are_rejected() -> None:
    with pytest.raises(ValueError, match="they do not begin with BALD"):
        unpack(b"PNG")


def test_counts_use_16_bits_if_possible() -> None:
    assert narrow(np.array([0, 65535], np.uint32)).dtype == np.uint16
    assert narrow(np.array([65536], np.uint32)).dtype == np.uint32
    assert narrow(np.empty(0, np.uint32)).dtype == np.uint16
