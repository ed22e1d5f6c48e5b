"""A study in an object store has the same records, and the same commands."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.core.file_writing import append_line, write_atomically, write_exclusively
from baldwinlab.core.files import SESSIONS_FILE, parse_location
from baldwinlab.papers.presets import factors
from baldwinlab.simulation import memory
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors import choose_executor, dask
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.status import read_status
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.local_clusters import local_cluster
from tests.object_store import local_object_store
from tests.small_studies import (
    ignore_message,
    make_small_study,
    read_records,
    shorten_preset,
)
from tests.studies.completion import complete_runs

pytest.importorskip("moto")
pytest.importorskip("s3fs")

SEED = 5
EXPERIMENT = shorten_preset("evo/A").replace(lifetime={"steps": 40})
# The runs of a task are stored in one object.
RUNS = 32


@pytest.fixture(scope="module")
def bucket() -> Iterator[str]:
    with local_object_store("laboratory") as url:
        yield url


def test_an_object_is_written_completely_or_not_at_all(bucket: str) -> None:
    path = parse_location(f"{bucket}/files/one")
    write_exclusively(path, b"first")
    with pytest.raises(FileExistsError):
        write_exclusively(path, b"second")
    assert path.read_bytes() == b"first"
    write_atomically(path, b"third")
    append_line(path, "line", SESSIONS_FILE)
    assert path.read_bytes() == b"thirdline\n"


def test_a_missing_bucket_is_refused_and_not_created(bucket: str, command: Command) -> None:
    outcome = command("run", "evo/A", "--runs", "1", "--out", "s3://misspelled/study")
    assert outcome.code != 0
    assert "bucket does not exist" in outcome.err
    assert len(outcome.err.strip().splitlines()) == 1
    assert not parse_location("s3://misspelled").exists()


def test_a_study_in_a_bucket_resumes_opens_and_has_a_status(
    bucket: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "MAX_RUNS_PER_FILE", 16)
    local = make_small_study(tmp_path, [EXPERIMENT], RUNS, SEED)
    location = parse_location(f"{bucket}/resumed")
    study = create_study(location, [EXPERIMENT], SEED, factors=factors())
    complete_runs(study, RUNS, 2)
    names = [file.path.name for file in study.files("evo/A")]
    assert names == [file.path.name for file in local.files("evo/A")]
    assert names == ["0000-0015.nc", "0016-0031.nc"]
    study.files("evo/A")[0].path.unlink()
    assert read_status(study).missing == {"evo/A": 16}
    complete_runs(StudyStore(location), RUNS)
    status = read_status(study)
    assert (status.done, status.failures) == ({"evo/A": RUNS}, ())
    stored = {file.path.name: file.path.read_bytes() for file in study.files("evo/A")}
    assert stored == {file.path.name: file.path.read_bytes() for file in local.files("evo/A")}
    assert open_runs(f"{bucket}/resumed").identical(open_runs(tmp_path))
    assert len(list(study.sessions())) == 2


@pytest.mark.nightly
def test_workers_of_a_cluster_store_the_records_of_threads_in_a_bucket(
    bucket: str, tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask, "MIN_EVENT_INTERVAL", 0)
    distributed: Any = pytest.importorskip("distributed")
    experiment = EXPERIMENT.replace(lifetime={"steps": 3000})
    directory = parse_location(f"{bucket}/cluster")
    study = create_study(directory, [experiment], SEED)
    with local_cluster(2) as cluster:
        is_killed = False

        def kill_worker(amount: int) -> None:
            nonlocal is_killed
            if not is_killed:
                with distributed.Client(cluster, set_as_default=False) as client:
                    os.kill(min(client.run(os.getpid).values()), signal.SIGKILL)
                is_killed = True

        # A worker is killed after the first progress, in the middle of a task.
        run_study(
            study,
            find_missing_runs(study, RUNS, ignore_message),
            2,
            lambda description, total: nullcontext(kill_worker),
            ignore_message,
            executor=choose_executor(f"dask:{cluster.scheduler_address}"),
        )
    local = make_small_study(tmp_path / "threads", [experiment], RUNS, SEED)
    actual = {file.path.name: file.path.read_bytes() for file in study.files("evo/A")}
    expected = read_records(local.directory)
    assert actual == {Path(name).name: content for name, content in expected.items()}
    report = tmp_path / "report.html"
    assert command("report", str(directory), "--out", str(report)).code == 0
    assert "<html" in report.read_text("utf-8")
