"""Test the number of threads of a task, and work in ranges."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import pytest

from baldwinlab.engine import threads as threads_module
from baldwinlab.engine.threads import (
    SharedThreads,
    available_cores,
    count_threads,
    run_in_ranges,
    run_in_threads,
    share_threads,
    use_threads,
)


def test_small_work_uses_one_thread() -> None:
    assert count_threads(10**6, 10) == 1
    with use_threads(4):
        assert [count_threads(size, 10) for size in (1, 19, 20, 35, 10**6)] == [1, 1, 2, 3, 4]
    assert count_threads(10**6, 10) == 1


@pytest.fixture
def limit_cores(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Return a function that sets the affinity and the quotas of the control groups."""

    def limit(affinity: int, quotas: Sequence[float] = (), variable: str = "") -> None:
        # The test sets the affinity on every system, and the variable in every version of Python.
        monkeypatch.delattr(os, "process_cpu_count", raising=False)
        monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(affinity)), False)
        monkeypatch.setattr(threads_module, "cores_of_groups", lambda: iter(quotas))
        monkeypatch.setenv("PYTHON_CPU_COUNT", variable)

    return limit


@pytest.mark.parametrize(
    ("affinity", "quotas", "cores"),
    [(16, [], 16), (2, [8.0], 2), (16, [8.0, 4.0], 4), (16, [1.5], 2), (16, [0.25], 1)],
)
def test_usable_cores_are_limited_by_affinity_and_control_groups(
    limit_cores: Callable[..., None], affinity: int, quotas: list[float], cores: int
) -> None:
    limit_cores(affinity, quotas)
    assert available_cores() == cores


@pytest.mark.parametrize(
    ("variable", "cores"), [("3", 3), ("1", 1), ("0", 1), ("default", 16), ("", 16), ("-2", 16)]
)
def test_a_variable_of_python_replaces_the_affinity(
    limit_cores: Callable[..., None], variable: str, cores: int
) -> None:
    limit_cores(16, variable=variable)
    assert available_cores() == cores
    # The quota of a control group applies to any number.
    limit_cores(16, [2.0], variable)
    assert available_cores() == min(cores, 2)


def test_python_counts_the_cores_of_the_process_if_it_can(
    limit_cores: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    limit_cores(16)
    monkeypatch.setattr(os, "process_cpu_count", lambda: 5, raising=False)
    assert available_cores() == 5


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no affinity")
def test_a_process_on_one_core_counts_one_core() -> None:
    code = (
        "import os; os.sched_setaffinity(0, [min(os.sched_getaffinity(0))]);"
        "from baldwinlab.engine.threads import available_cores; print(available_cores())"
    )
    environment = os.environ | {"PYTHON_CPU_COUNT": "default"}
    finished = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, check=True
    )
    assert int(finished.stdout) == 1


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


def test_the_ranges_of_several_tasks_share_the_threads_of_a_pool() -> None:
    ranges: list[tuple[int, int]] = []
    threads: set[str] = set()

    def record(first: int, end: int) -> None:
        ranges.append((first, end))
        threads.add(threading.current_thread().name)

    with ThreadPoolExecutor(2, thread_name_prefix="shared") as pool:
        for size, n_ranges in ((23, 5), (4, 4), (1, 1)):
            ranges.clear()
            with share_threads(SharedThreads(pool, 5)):
                run_in_ranges(record, size, 1)
            covered = [index for first, end in sorted(ranges) for index in range(first, end)]
            assert covered == list(range(size))
            assert len(ranges) == n_ranges
    # A single range does not wait for a thread of the pool.
    assert threads <= {"shared_0", "shared_1", threading.current_thread().name}
    assert threading.current_thread().name in threads


def test_an_error_in_a_shared_thread_is_raised_in_the_task() -> None:
    def fail(first: int, end: int) -> None:
        raise ValueError(f"range {first} to {end}")

    with (
        ThreadPoolExecutor(2) as pool,
        share_threads(SharedThreads(pool, 2)),
        pytest.raises(ValueError, match="range 0 to 2"),
    ):
        run_in_ranges(fail, 4, 1)
