"""The cache of arrays of the runs of a batch."""

from __future__ import annotations

from threading import Thread

import numpy as np
import numpy.typing as npt

from baldwinlab.models import kit


def test_a_batch_of_any_size_computes_each_run_once_beside_other_threads() -> None:
    computed: list[int] = []

    def make_array(seed: int, run: int, size: int) -> npt.NDArray[np.int64]:
        computed.append(run)
        return np.full(size, seed + run)

    cache = kit.BatchCache(make_array)
    runs = range(500)

    def simulate_generations(first_run: int) -> None:
        for _ in range(3):
            arrays, rows = cache.get(7, [first_run + run for run in runs], 2)
            assert (arrays[rows[30]] == 7 + first_run + 30).all()

    simulate_generations(0)
    thread = Thread(target=simulate_generations, args=(1000,))
    thread.start()
    thread.join()
    simulate_generations(0)
    assert computed == [*runs, *range(1000, 1500)]


def test_copies_of_a_run_share_its_array() -> None:
    cache = kit.BatchCache(lambda seed, run: np.array([run]))
    arrays, rows = cache.get(0, [8, 5, 8, 5])
    assert arrays[rows].ravel().tolist() == [8, 5, 8, 5]
    assert len(arrays) == 2
