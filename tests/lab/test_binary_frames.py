"""The container in which frames travel."""

from __future__ import annotations

import json
import zlib

import numpy as np
import pytest

from baldwinlab.lab.binary_frames import DTYPES, narrow, pack, unpack


def test_what_is_packed_is_unpacked() -> None:
    arrays = {dtype: np.arange(15).astype(dtype).reshape(5, 3) for dtype in DTYPES} | {
        "none": np.empty((0, 2), np.float32)
    }
    header, found = unpack(pack({"kind": "test", "größe": 3}, arrays))
    assert header["kind"] == "test"
    assert header["größe"] == 3
    assert list(found) == list(arrays)
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype
        assert np.array_equal(found[name], array)


def test_differences_from_row_to_row_are_exact_and_deflate_well() -> None:
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
def test_every_array_begins_at_a_multiple_of_eight_bytes(text: str) -> None:
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


def test_numbers_are_little_endian_and_in_rows_whatever_they_were() -> None:
    array = np.arange(6, dtype=">i4").reshape(2, 3).T
    raw = pack({}, {"a": array})
    assert raw.endswith(np.array([0, 3, 1, 4, 2, 5], "<i4").tobytes())


def test_a_type_that_browsers_have_no_array_for_is_refused() -> None:
    with pytest.raises(
        ValueError, match="array a is of type float64; it must be one of int8, uint8"
    ):
        pack({}, {"a": np.zeros(1)})


def test_other_bytes_are_no_container() -> None:
    with pytest.raises(ValueError, match="they do not begin with BALD"):
        unpack(b"PNG")


def test_counts_take_16_bits_where_they_fit() -> None:
    assert narrow(np.array([0, 65535], np.uint32)).dtype == np.uint16
    assert narrow(np.array([65536], np.uint32)).dtype == np.uint32
    assert narrow(np.empty(0, np.uint32)).dtype == np.uint16
