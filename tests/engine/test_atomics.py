"""Test atomic operations, barriers of threads, and prefetches."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.atomics import (
    Team,
    atomic_add,
    atomic_max,
    prefetch,
    share_of_thread,
    wait_for_team,
)
from baldwinlab.engine.jit import cached_jit
from baldwinlab.engine.threads import run_in_threads

THREADS = 4
ROUNDS = 5_000


def _count(numbers: Any, thread: int, rounds: int) -> None:
    for number in range(rounds):
        atomic_add(numbers, 0, 1)
        atomic_max(numbers, 1, thread * rounds + number)


def _shift(team: Team, numbers: Any, rounds: int) -> None:
    """In each round, copy the number of the next thread and add 1."""
    for number in range(rounds):
        source = number % 2
        following = (team.thread + 1) % team.threads
        numbers[1 - source, team.thread] = numbers[source, following] + 1
        wait_for_team(team)


def test_threads_lose_no_operation() -> None:
    numbers = np.zeros(2, np.int64)
    count = cached_jit(_count)
    count(numbers, 0, 0)
    run_in_threads(lambda thread: count(numbers, thread, ROUNDS), THREADS)
    assert numbers.tolist() == [THREADS * ROUNDS, THREADS * ROUNDS - 1]


def test_plain_python_returns_the_previous_value() -> None:
    numbers = np.array([5, 7], np.int64)
    assert (atomic_add(numbers, 0, 2), atomic_max(numbers, 1, 3)) == (5, 7)
    assert numbers.tolist() == [7, 7]


def test_threads_wait_for_each_other() -> None:
    arrivals = np.zeros(1, np.int64)
    numbers = np.arange(2 * THREADS).reshape(2, THREADS)
    expected = numbers[0].copy()
    shift = cached_jit(_shift)
    shift(Team(0, 1, arrivals), numbers.copy(), 0)
    run_in_threads(lambda thread: shift(Team(thread, THREADS, arrivals), numbers, 300), THREADS)
    for _ in range(300):
        expected = np.roll(expected, -1) + 1
    assert numbers[0].tolist() == expected.tolist()


def test_shares_of_threads_cover_a_range() -> None:
    for threads in (1, 2, 3, 7):
        arrivals: npt.NDArray[np.int64] = np.zeros(1, np.int64)
        shares = [share_of_thread(Team(t, threads, arrivals), 4, 9) for t in range(threads)]
        assert [number for first, end in shares for number in range(first, end)] == [4, 5, 6, 7, 8]


def _prefetch_beyond_end(array: Any) -> None:
    for column in range(2 * array.shape[1]):
        prefetch(array, array.shape[0], column)


def test_prefetch_changes_no_item_and_accepts_missing_items() -> None:
    array = np.arange(6.0, dtype=np.float32).reshape(2, 3)
    for function in (_prefetch_beyond_end, cached_jit(_prefetch_beyond_end)):
        function(array)
    assert array.tolist() == [[0, 1, 2], [3, 4, 5]]
