"""Clusters of separate processes that lose, gain and share workers: the records are the same."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.studies import progress
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors import choose_executor, dask
from baldwinlab.studies.record_files import assign_runs
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.run_task import Callback
from baldwinlab.studies.status import read_status
from baldwinlab.studies.store import StudyStore
from tests.local_clusters import local_cluster
from tests.paused_studies import WaitForFile
from tests.small_studies import ignore_message, make_small_study, shorten_preset

pytest.importorskip("distributed")
pytestmark = pytest.mark.nightly

SEED = 5
# Batches of 138 runs.
RUNS = 400
EXPERIMENT: Experiment = shorten_preset("evo/A").replace(
    lifetime={"steps": 600}, record={"genome_every": 3}
)


def run_on(
    cluster: Any,
    study: StudyStore,
    observe_progress: Callable[[], None] = lambda: None,
    callback: Callback | None = None,
) -> None:
    """Run a study on a cluster. `observe_progress` is called after each report of a worker."""

    @contextmanager
    def progress(description: str, total: int) -> Iterator[Callable[[int], None]]:
        yield lambda amount: observe_progress()

    run_study(
        study,
        find_missing_runs(study, RUNS, ignore_message),
        2,
        progress,
        ignore_message,
        executor=choose_executor(f"dask:{cluster.scheduler_address}"),
        callback=callback,
    )


@contextmanager
def repeat(action: Callable[[], object], interval: float) -> Iterator[None]:
    """Repeat an action in another thread until the end of the context."""
    is_done = threading.Event()

    def loop() -> None:
        while not is_done.wait(interval):
            action()

    thread = threading.Thread(target=loop)
    thread.start()
    try:
        yield
    finally:
        is_done.set()
        thread.join()


def read_values(study: StudyStore) -> Mapping[int, bytes]:
    """Return the bytes of the arrays of each run. The files of two studies can differ."""
    return {
        run: b"".join(record[name].values.tobytes() for name in sorted(map(str, record.data_vars)))
        for run, record in study.records("evo/A")
    }


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> Mapping[int, bytes]:
    directory = tmp_path_factory.mktemp("threads")
    return read_values(make_small_study(directory, [EXPERIMENT], RUNS, SEED))


def test_a_study_whose_workers_are_killed_again_and_again_has_the_records_of_threads(
    tmp_path: Path, expected: Mapping[int, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask, "MIN_EVENT_INTERVAL", 0)
    study = create_study(tmp_path, [EXPERIMENT], SEED)
    killed = set[int]()
    with local_cluster(2) as cluster:

        def kill_worker() -> None:
            pids = {nanny.pid for nanny in cluster.workers.values() if nanny.pid} - killed
            # Another kill waits for the replacement of the killed worker.
            if len(pids) == len(cluster.scheduler.workers) == 2 and len(killed) < 3:
                os.kill(min(pids), signal.SIGKILL)
                killed.add(min(pids))

        # By default, the scheduler gives a task up after it has ended four workers.
        cluster.scheduler.allowed_failures = 100
        run_on(cluster, study, kill_worker)
    assert killed
    assert read_values(study) == expected


def test_an_adaptive_cluster_starts_workers_for_a_study_and_ends_them_after_it(
    tmp_path: Path, expected: Mapping[int, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "WRITE_INTERVAL", 0)
    # A worker reports its first generation, however short it is.
    monkeypatch.setattr(dask, "MIN_EVENT_INTERVAL", 0)
    monkeypatch.setattr(dask, "EVENTS_PER_SECOND", 1e9)
    study = create_study(tmp_path, [EXPERIMENT], SEED)
    both_work = WaitForFile(tmp_path / "both-work")

    def read_workers() -> None:
        if read_status(study).workers == 2:
            both_work.path.touch()

    with local_cluster(0) as cluster:
        cluster.adapt(minimum=0, maximum=2, interval="200ms", target_duration="100ms")
        with repeat(read_workers, interval=0.05):
            run_on(cluster, study, callback=both_work)
        while cluster.scheduler.workers:
            time.sleep(0.1)
    assert both_work.path.exists()
    assert read_values(study) == expected


def test_two_submissions_of_a_study_at_once_store_the_records_of_threads(
    tmp_path: Path, expected: Mapping[int, bytes]
) -> None:
    study = create_study(tmp_path, [EXPERIMENT], SEED)
    with local_cluster(2) as cluster:
        command = [sys.executable, "-m", "baldwinlab", "run", str(study.directory)]
        options = ["--runs", str(RUNS), "--executor", f"dask:{cluster.scheduler_address}"]
        submissions = [subprocess.Popen([*command, *options]) for _ in range(2)]
        assert [process.wait() for process in submissions] == [0, 0]
    assert read_values(study) == expected
    stored = [run for entry in assign_runs(study.files("evo/A")) for run in entry.runs]
    assert sorted(stored) == list(range(RUNS))
