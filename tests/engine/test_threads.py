"""Test the number of threads of a task, and work in ranges."""

from __future__ import annotations

import threading

import pytest

from baldwinlab.engine.threads import (
    available_cores,
    count_threads,
    run_in_ranges,
    run_in_threads,
    use_threads,
)


def test_small_work_uses_one_thread() -> None:
    assert count_threads(10**6, 10) == 1
    with use_threads(4):
        assert [count_threads(size, 10) for size in (1, 19, 20, 35, 10**6)] == [1, 1, 2, 3, 4]
    assert count_threads(10**6, 10) == 1
    assert available_cores() >= 1


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_ranges_cover_all_entries(threads: int) -> None:
    ranges = list[tuple[int, int]]()
    with use_threads(threads):
        run_in_ranges(lambda first, end: ranges.append((first, end)), 23, 3)
    assert len(ranges) == threads
    assert [entry for first, end in sorted(ranges) for entry in range(first, end)] == [*range(23)]


def test_functions_run_at_the_same_time() -> None:
    barrier = threading.Barrier(3, timeout=60)

    def wait(thread: int) -> None:
        barrier.wait()

    run_in_threads(wait, 3)


def test_errors_of_threads_are_raised() -> None:
    def fail(thread: int) -> None:
        if thread == 1:
            raise ValueError("thread 1")

    with pytest.raises(ValueError, match="thread 1"):
        run_in_threads(fail, 2)
