"""All executors produce bit-identical studies."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from dask import config as dask_config

from baldwinlab.core.extras import installation_command
from baldwinlab.core.files import parse_location
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation import memory
from baldwinlab.studies.assays.catalog import load_assays
from baldwinlab.studies.assays.results import find_missing_assays
from baldwinlab.studies.assays.run import run_assays
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors import THREADS, Executor, ExecutorError, choose_executor, dask
from baldwinlab.studies.records import DamagedRecordError, StudyError
from baldwinlab.studies.run import find_missing_runs, plan_tasks
from baldwinlab.studies.run_task import RunTask
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.local_clusters import local_cluster
from tests.paused_studies import pause_writes
from tests.small_studies import (
    ignore_message,
    make_small_study,
    read_records,
    shorten_preset,
)
from tests.studies.assays.studies import conditions, make_small_study_with_assays
from tests.studies.completion import complete_assays

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with local_cluster(2) as two_workers:
        yield two_workers


@pytest.fixture
def on_dask(cluster: Any) -> Executor:
    return choose_executor(f"dask:{cluster.scheduler_address}")


@pytest.fixture(params=["threads first", "cluster first"])
def two_executors(request: pytest.FixtureRequest, on_dask: Executor) -> tuple[Executor, Executor]:
    return (THREADS, on_dask) if request.param == "threads first" else (on_dask, THREADS)


def simulated_steps(
    executor: Executor, study: StudyStore, runs: int, tasks: int = 2
) -> Generator[int, None, None]:
    """Simulate runs with two workers. They are divided into at least `tasks` tasks."""
    missing = find_missing_runs(study, runs, ignore_message)
    is_one_process = executor.name == THREADS.name
    return executor.run(
        study, plan_tasks(study, missing, tasks, is_one_process=is_one_process), 2, CPU
    )


@pytest.fixture
def pause(monkeypatch: pytest.MonkeyPatch) -> Callable[[Path], None]:
    """Return a function: executors do not store all records of a folder before the test goes on."""

    def pause_executors(directory: Path) -> None:
        # The threads share a writer. With files of several runs, it would store all runs at the end
        # of the last one, so that it would wait for a test that waits for it.
        monkeypatch.setattr(memory, "MAX_RUNS_PER_FILE", 1)
        pause_writes(monkeypatch, directory, 1)
        # The client submits the next task after the test has seen the end of the last one.
        monkeypatch.setattr(dask, "TASKS_PER_WAVE", 1)
        monkeypatch.setattr(dask, "TASKS_PER_CORE", 0)

    return pause_executors


def worker_pids(cluster: Any) -> list[int]:
    with distributed.Client(cluster) as client:
        return list(client.run(os.getpid).values())


def test_worker_processes_and_threads_store_identical_studies(
    tmp_path: Path, on_dask: Executor
) -> None:
    study = create_study(
        tmp_path / "dask", [shorten_preset("evo/A"), shorten_preset("evo+self-taught/A")], seed=5
    )
    assert on_dask.workers == 2
    assert sum(simulated_steps(on_dask, study, runs=6)) == 2 * 6 * 3 * 300 * 20
    assert read_records(study.directory) == read_records(
        make_small_study(tmp_path / "threads", runs=6).directory
    )


@pytest.mark.nightly
def test_worker_processes_and_threads_write_equal_files_of_many_runs(
    tmp_path: Path, on_dask: Executor
) -> None:
    # A file has at most 20 runs, and the last one of these files has 16.
    experiment = shorten_preset("evo/A").replace(lifetime={"steps": 4100})
    study = create_study(tmp_path / "dask", [experiment], seed=5)
    list(simulated_steps(on_dask, study, runs=56))
    records = read_records(study.directory)
    assert [Path(name).name for name in records] == ["0000-0019.nc", "0020-0039.nc", "0040-0055.nc"]
    threads = make_small_study(tmp_path / "threads", [experiment], runs=56)
    assert records == read_records(threads.directory)


@pytest.mark.nightly
def test_the_scheduler_has_one_wave_of_tasks_at_a_time(
    tmp_path: Path, cluster: Any, on_dask: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask, "TASKS_PER_WAVE", 4)
    study = create_study(tmp_path / "waves", [shorten_preset("evo/A")], seed=5)
    tasks = [RunTask(study.experiment("evo/A"), (run,), is_new=True) for run in range(20)]
    n_tasks = []
    for _ in on_dask.run(study, tasks, 2, CPU):
        n_tasks.append(len(cluster.scheduler.tasks))
    # The scheduler releases a finished task some time after the next wave has begun.
    assert 1 <= max(n_tasks) <= 4 + 4 // 2
    # These tasks store a file per run, and the threads store a file of 20 runs.
    threads = make_small_study(tmp_path / "threads", [shorten_preset("evo/A")], runs=20)
    for run in range(20):
        xr.testing.assert_identical(study.record("evo/A", run), threads.record("evo/A", run))


@pytest.mark.nightly
def test_a_task_whose_workers_die_repeatedly_raises_an_error_of_one_sentence(
    tmp_path: Path, cluster: Any, on_dask: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster.scheduler, "allowed_failures", 0)
    monkeypatch.setattr(dask, "MIN_EVENT_INTERVAL", 0)
    study = create_study(
        tmp_path, [shorten_preset("evo/A").replace(lifetime={"steps": 2_000_000})], seed=5
    )
    with (
        closing(simulated_steps(on_dask, study, runs=2)) as steps,
        pytest.raises(ExecutorError, match="ended 1 workers"),
    ):
        next(steps)
        for pid in worker_pids(cluster):
            os.kill(pid, signal.SIGKILL)
        next(steps)
        next(steps)


@pytest.mark.nightly
def test_workers_report_progress_within_a_task(
    tmp_path: Path, on_dask: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask, "MIN_EVENT_INTERVAL", 0)
    # The batches take a fraction of a second.
    experiment = shorten_preset("evo/A").replace(
        lifetime={"steps": 6000}, evolution={"generations": 12}
    )
    study = create_study(tmp_path, [experiment], seed=5)
    reports = list(simulated_steps(on_dask, study, runs=2))
    # The study has only two tasks.
    assert len(reports) > 4
    assert sum(reports) == 2 * 12 * 6000 * 20


@pytest.mark.nightly
def test_an_interrupted_study_resumes_with_a_different_executor(
    tmp_path: Path,
    two_executors: tuple[Executor, Executor],
    pause: Callable[[Path], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first, second = two_executors
    study = create_study(tmp_path / "moved", [shorten_preset("evo/A")], seed=5)
    pause(study.directory)
    with closing(simulated_steps(first, study, runs=12, tasks=12)) as steps:
        while not read_records(study.directory):
            next(steps)
    monkeypatch.undo()
    before = read_records(study.directory)
    list(simulated_steps(second, study, runs=12))
    assert 0 < len(before) < 12
    assert before.items() <= read_records(study.directory).items()
    whole = make_small_study(tmp_path / "whole", [shorten_preset("evo/A")], runs=12)
    for run in range(12):
        xr.testing.assert_identical(study.record("evo/A", run), whole.record("evo/A", run))


@pytest.mark.nightly
def test_workers_end_tasks_of_a_closed_client(
    tmp_path: Path, cluster: Any, on_dask: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask, "MIN_EVENT_INTERVAL", 0)
    study = create_study(
        tmp_path, [shorten_preset("evo/A").replace(evolution={"generations": 10_000})], seed=5
    )
    with closing(simulated_steps(on_dask, study, runs=2)) as steps:
        next(steps)
    with distributed.Client(cluster) as client:
        while any(client.run(lambda dask_worker: len(dask_worker.state.tasks)).values()):
            time.sleep(0.05)
    assert read_records(tmp_path) == {}


def test_workers_refuse_a_study_that_they_cannot_access(on_dask: Executor) -> None:
    study = create_study(parse_location("memory://unseen"), [shorten_preset("evo/A")], seed=5)
    with pytest.raises(
        StudyError,
        match=r"cannot access memory://unseen: put the study where all workers can access it",
    ):
        list(simulated_steps(on_dask, study, runs=2))


@pytest.mark.nightly
def test_worker_processes_and_threads_store_identical_assays(
    tmp_path: Path, on_dask: Executor
) -> None:
    on_cluster = make_small_study_with_assays(tmp_path / "dask", executor=on_dask)
    on_threads = make_small_study_with_assays(tmp_path / "threads")
    assert read_records(on_cluster.directory) == read_records(on_threads.directory)
    assert {
        path.parts[0] for path in map(Path, read_records(on_threads.directory / "assays"))
    } == set(load_assays()) - {"opponents"}


@pytest.mark.nightly
def test_interrupted_assays_resume_with_a_different_executor(
    tmp_path: Path,
    two_executors: tuple[Executor, Executor],
    pause: Callable[[Path], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first, second = two_executors
    study = make_small_study(tmp_path / "moved", conditions())
    pause(study.directory / "assays")

    @contextmanager
    def interrupt_after_first_assay(
        description: str, total: int
    ) -> Iterator[Callable[[int], None]]:
        def stop(amount: int) -> None:
            if (study.directory / "assays").exists():
                raise KeyboardInterrupt

        yield stop

    with pytest.raises(KeyboardInterrupt):
        run_assays(
            study,
            find_missing_assays(study, ["innate"]),
            1,
            interrupt_after_first_assay,
            ignore_message,
            executor=first,
        )
    monkeypatch.undo()
    before = read_records(study.directory / "assays")
    complete_assays(study, ["innate"], 2, executor=second)
    expected = read_records(
        make_small_study_with_assays(tmp_path / "whole", names=["innate"]).directory / "assays"
    )
    assert 0 < len(before) < len(expected) == len(conditions())
    assert read_records(study.directory / "assays") == expected
    assert before.items() <= expected.items()


def test_all_executors_name_a_damaged_record(tmp_path: Path, on_dask: Executor) -> None:
    study = make_small_study(tmp_path, [shorten_preset("evo/A")], runs=2)
    path = study.path("evo/A", 1)
    path.write_bytes(path.read_bytes()[:-1])
    for executor in (THREADS, on_dask):
        with pytest.raises(
            DamagedRecordError, match=r"0001\.nc is damaged: its checksum does not fit its content"
        ):
            complete_assays(study, ["descent"], 2, executor=executor)


def test_workers_with_a_different_engine_refuse_tasks(
    tmp_path: Path, on_dask: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask, "ENGINE_HASH", "engine-of-yesterday")
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=5)
    with pytest.raises(StudyError, match="has another version of baldwinlab or Numba"):
        list(simulated_steps(on_dask, study, runs=2))


@pytest.mark.nightly
def test_a_lost_scheduler_raises_an_error_of_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=5)
    with local_cluster(0) as empty:
        steps = simulated_steps(choose_executor(f"dask:{empty.scheduler_address}"), study, runs=2)
        empty.loop.call_later(0.5, empty.close)
        # The client also tries to connect again for this number of seconds.
        monkeypatch.setattr(dask, "CONNECTION_TIMEOUT", 1)
        with pytest.raises(ExecutorError, match="the connection to the Dask scheduler is lost"):
            next(steps)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        *(
            (
                ["--executor", name],
                f"--executor {name} must be threads, dask:tcp://HOST:PORT or slurm",
            )
            for name in ("treads", "dask", "dask:127.0.0.1:8786")
        ),
        (
            ["--executor", "dask:tcp://127.0.0.1:9"],
            "no Dask scheduler answers at tcp://127.0.0.1:9",
        ),
        (
            ["--executor", "dask:tcp://127.0.0.1:9", "--workers", "3"],
            "--workers 3 is for threads and slurm",
        ),
        (["--executor", "slurm"], "--executor slurm needs --workers"),
        (["--out", "nowhere://study"], "nowhere://study cannot be reached"),
    ],
)
def test_invalid_executors_and_locations_are_refused_in_one_sentence(
    arguments: list[str],
    sentence: str,
    tmp_path: Path,
    command: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(dask, "CONNECTION_TIMEOUT", 0.5)
    code, _, err = command("run", "evo/A", "--runs", "1", *arguments)
    assert code != 0
    assert sentence in err
    assert len(err.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_slurm_requires_the_resources_of_a_job(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: f"/usr/bin/{name}")
    with pytest.raises(
        ValueError,
        match=r"needs jobqueue\.slurm\.cores and jobqueue\.slurm\.memory in Dask's configuration",
    ):
        choose_executor("slurm", 2)


@pytest.mark.parametrize(
    ("script", "reason"),
    [
        ("echo first; echo 'sbatch: error: no such account' >&2; exit 1", "no such account"),
        ("exit 3", "sbatch ended with status 3"),
    ],
)
def test_the_reason_of_a_refused_job_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, reason: str
) -> None:
    pytest.importorskip("dask_jobqueue")
    sbatch = tmp_path / "bin/sbatch"
    sbatch.parent.mkdir()
    sbatch.write_text(f"#!/bin/sh\n{script}\n")
    sbatch.chmod(0o755)
    monkeypatch.setenv("PATH", f"{sbatch.parent}{os.pathsep}{os.environ['PATH']}")
    study = create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=5)
    job = {"cores": 1, "memory": "1 GB", "interface": None}
    settings = {f"jobqueue.slurm.{name}": value for name, value in job.items()}
    with (
        dask_config.set(settings),
        pytest.raises(ExecutorError, match=f"Slurm refuses the job: .*{reason}"),
    ):
        list(simulated_steps(choose_executor("slurm", 1), study, runs=1))


@pytest.mark.parametrize("module", ["distributed", "dask_jobqueue", "upath"])
def test_without_the_cluster_extra_only_threads_work_and_the_error_names_the_extra(
    module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    assert choose_executor("threads", 3) == THREADS._replace(workers=3)
    for name, workers in (("dask:tcp://127.0.0.1:9", None), ("slurm", 2)):
        with pytest.raises(ValueError, match=re.escape(installation_command("cluster"))):
            choose_executor(name, workers)


@pytest.mark.parametrize(
    ("module", "url", "extra"),
    [
        ("upath", "s3://bucket/study", "s3"),
        ("upath", "gs://bucket/study", "cluster"),
        ("s3fs", "s3://bucket/study", "s3"),
    ],
)
def test_without_its_extra_a_url_is_refused_and_the_error_names_the_extra(
    module: str, url: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ValueError, match=re.escape(installation_command(extra))):
        parse_location(url)


@pytest.mark.nightly
def test_the_same_command_runs_on_a_cluster(tmp_path: Path, cluster: Any, command: Command) -> None:
    settings = ("--set", "evolution.generations=2", "lifetime.steps=60")
    arguments = ("run", "evo/A", "--runs", "4", *settings)
    cluster_options = ("--executor", f"dask:{cluster.scheduler_address}")
    assert command(*arguments, *cluster_options, "--out", "dask").code == 0
    assert command(*arguments, "--out", "threads").code == 0
    assert read_records(tmp_path / "dask") == read_records(tmp_path / "threads") != {}
    (session,) = StudyStore(tmp_path / "dask").sessions()
    assert (session["executor"], session["workers"]) == ("dask", 2)
    assays = ("--assays", "innate,descent")
    assert command("assay", "dask", *assays, *cluster_options).code == 0
    assert command("assay", "threads", *assays).code == 0
    assert read_records(tmp_path / "dask") == read_records(tmp_path / "threads")


def test_a_study_and_its_report_can_be_in_an_object_store(command: Command, tmp_path: Path) -> None:
    short = ["evolution.generations=2", "lifetime.steps=40"]
    arguments = ["run", "evo/A", "--runs", "2", "--set", *short, "--out", "memory://tests/paper"]
    assert command(*arguments)[0] == 0
    code, out, _ = command("report", "memory://tests/paper")
    assert code == 0
    assert "report: memory://tests/paper/report.html" in out
    assert "<html" in parse_location("memory://tests/paper/report.html").read_text("utf-8")
    assert parse_location("memory://tests/paper/figures").exists()
    assert not list(tmp_path.iterdir())


def slurm_is_unavailable() -> bool:
    return (
        not shutil.which("sinfo")
        or subprocess.run(["sinfo", "--noheader"], capture_output=True, timeout=20).returncode != 0
    )


@pytest.mark.nightly
@pytest.mark.skipif(
    slurm_is_unavailable(), reason="no Slurm is available: `make slurm` installs it"
)
def test_slurm_jobs_and_threads_store_identical_studies_even_if_a_job_is_canceled(
    tmp_path: Path,
) -> None:
    command = [sys.executable, "-m", "baldwinlab", "run"]
    arguments = [*command, "evo/A", "--runs", "200", "--set", "evolution.generations=20"]
    job = {"DASK_JOBQUEUE__SLURM__CORES": "1", "DASK_JOBQUEUE__SLURM__MEMORY": "1GiB"}
    job |= {"DASK_JOBQUEUE__SLURM__INTERFACE": "lo"}
    job["PYTHONPATH"] = str(Path(__file__).parent.parent)
    slurm = [*arguments, "--out", "slurm", "--executor", "slurm", "--workers", "2"]
    process = subprocess.Popen(
        slurm, cwd=tmp_path, env=os.environ | job, stdout=subprocess.PIPE, text=True
    )
    while process.poll() is None and not read_records(tmp_path):
        time.sleep(0.05)
    jobs = subprocess.run(
        ["squeue", "--noheader", "--format=%i"], capture_output=True, text=True, check=True
    ).stdout.split()
    subprocess.run(["scancel", jobs[0]], check=True)
    out, _ = process.communicate()
    assert process.returncode == 0, out
    subprocess.run([*arguments, "--out", "threads"], cwd=tmp_path, env=os.environ | job, check=True)
    assert read_records(tmp_path / "slurm") == read_records(tmp_path / "threads")
