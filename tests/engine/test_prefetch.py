"""Test that loading memory into the cache changes nothing."""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.atomics import prefetch
from baldwinlab.engine.jit import cached_jit


def _prefetch_beyond_end(array: Any) -> None:
    for column in range(2 * array.shape[1]):
        prefetch(array, array.shape[0], column)


def test_prefetch_changes_no_item_and_accepts_missing_items() -> None:
    array = np.arange(6.0, dtype=np.float32).reshape(2, 3)
    for function in (_prefetch_beyond_end, cached_jit(_prefetch_beyond_end)):
        function(array)
    assert array.tolist() == [[0, 1, 2], [3, 4, 5]]
