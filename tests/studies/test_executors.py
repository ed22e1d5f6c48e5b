"""A study is the same, bit for bit, wherever its tasks are done."""

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

from baldwinlab import cli
from baldwinlab.core.extras import installation_command
from baldwinlab.core.files import parse_location
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.studies.assays.catalog import ASSAYS
from baldwinlab.studies.assays.results import find_missing_assays
from baldwinlab.studies.assays.run import run_assays
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors import THREADS, Executor, ExecutorError, choose, dask
from baldwinlab.studies.records import DamagedRecordError, StudyError
from baldwinlab.studies.run import find_missing_runs, plan_tasks
from baldwinlab.studies.store import StudyStore
from tests.small_studies import (
    ignore_message,
    ignore_progress,
    make_small_study,
    read_records,
    shorten_preset,
)
from tests.studies.assays.studies import conditions, measured

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def local() -> Iterator[Any]:
    """A Dask cluster of two worker processes on this machine."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as found:
        yield found


@pytest.fixture
def on_dask(local: Any) -> Executor:
    return choose(f"dask:{local.scheduler_address}")


def longer(name: str) -> Experiment:
    """Of which a batch takes a fraction of a second."""
    return shorten_preset(name).replace(lifetime={"steps": 6000})


def amounts(
    executor: Executor, study: StudyStore, runs: int, workers: int = 2
) -> Generator[int, None, None]:
    return executor.run(
        study,
        plan_tasks(study, find_missing_runs(study, runs, ignore_message), workers),
        workers,
        CPU,
    )


def pids(local: Any) -> list[int]:
    with distributed.Client(local) as client:
        return list(client.run(os.getpid).values())


def test_a_study_done_by_worker_processes_holds_the_bits_of_one_done_by_threads(
    tmp_path: Path, on_dask: Executor
) -> None:
    study = create_study(
        tmp_path / "dask", [shorten_preset("evo/A"), shorten_preset("evo+self-taught/A")], seed=5
    )
    assert on_dask.workers == 2
    assert sum(amounts(on_dask, study, runs=6)) == 2 * 6 * 3 * 300 * 20
    assert read_records(study.directory) == read_records(
        make_small_study(tmp_path / "threads", runs=6).directory
    )


def test_a_worker_killed_in_the_middle_loses_nothing(
    tmp_path: Path, local: Any, on_dask: Executor
) -> None:
    conditions = [longer("evo/A"), longer("evo+self-taught/A")]
    study = create_study(tmp_path / "killed", conditions, seed=5)
    done, victims = 0, pids(local)
    for amount in amounts(on_dask, study, runs=16):
        if not done:
            os.kill(victims[0], signal.SIGKILL)
        done += amount
    assert done == 2 * 16 * 3 * 6000 * 20
    assert read_records(study.directory) == read_records(
        make_small_study(tmp_path / "whole", conditions, runs=16).directory
    )


def test_a_task_whose_workers_keep_dying_is_given_up_in_a_sentence(
    tmp_path: Path, local: Any, on_dask: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(local.scheduler, "allowed_failures", 0)
    monkeypatch.setattr(dask, "EVENT_INTERVAL", 0)
    study = create_study(
        tmp_path, [shorten_preset("evo/A").replace(lifetime={"steps": 2_000_000})], seed=5
    )
    with (
        closing(amounts(on_dask, study, runs=2)) as steps,
        pytest.raises(ExecutorError, match="ended 1 workers"),
    ):
        next(steps)
        for pid in pids(local):
            os.kill(pid, signal.SIGKILL)
        next(steps)
        next(steps)


def test_workers_tell_how_far_they_are_within_a_task(
    tmp_path: Path, on_dask: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask, "EVENT_INTERVAL", 0)
    study = create_study(tmp_path, [longer("evo/A").replace(evolution={"generations": 12})], seed=5)
    heard = list(amounts(on_dask, study, runs=2))
    assert len(heard) > 4  # though there are but two tasks
    assert sum(heard) == 2 * 12 * 6000 * 20


@pytest.mark.parametrize("first_on_threads", [True, False])
def test_what_is_stopped_in_one_place_is_carried_on_in_another(
    tmp_path: Path, on_dask: Executor, first_on_threads: bool
) -> None:
    first, second = (THREADS, on_dask) if first_on_threads else (on_dask, THREADS)
    study = create_study(tmp_path / "moved", [longer("evo/A")], seed=5)
    with closing(amounts(first, study, runs=12)) as steps:
        while not read_records(study.directory):
            next(steps)
    kept = read_records(study.directory)
    list(amounts(second, study, runs=12))
    whole = read_records(make_small_study(tmp_path / "whole", [longer("evo/A")], runs=12).directory)
    assert 0 < len(kept) < 12
    assert read_records(study.directory) == whole
    assert kept.items() <= whole.items()


def test_workers_end_tasks_that_nobody_waits_for(
    tmp_path: Path, local: Any, on_dask: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask, "EVENT_INTERVAL", 0)
    study = create_study(
        tmp_path, [shorten_preset("evo/A").replace(evolution={"generations": 10_000})], seed=5
    )
    with closing(amounts(on_dask, study, runs=2)) as steps:
        next(steps)
    deadline = time.monotonic() + 20
    with distributed.Client(local) as client:
        while any(client.run(lambda dask_worker: len(dask_worker.state.tasks)).values()):
            assert time.monotonic() < deadline
            time.sleep(0.05)
    assert read_records(tmp_path) == {}


def test_workers_refuse_a_study_that_they_do_not_see(on_dask: Executor) -> None:
    study = create_study(parse_location("memory://unseen"), [shorten_preset("evo/A")], seed=5)
    with pytest.raises(
        StudyError,
        match=r"cannot access memory://unseen: put the study where all workers can access it",
    ):
        list(amounts(on_dask, study, runs=2))


def test_assays_done_by_worker_processes_hold_the_bits_of_those_done_by_threads(
    tmp_path: Path, on_dask: Executor
) -> None:
    there, here = measured(tmp_path / "dask", executor=on_dask), measured(tmp_path / "threads")
    assert read_records(there.directory) == read_records(here.directory)
    assert {path.parts[0] for path in map(Path, read_records(here.directory / "assays"))} == set(
        ASSAYS
    )


@pytest.mark.parametrize("first_on_threads", [True, False])
def test_assays_stopped_in_one_place_are_carried_on_in_another(
    tmp_path: Path, on_dask: Executor, first_on_threads: bool
) -> None:
    first, second = (THREADS, on_dask) if first_on_threads else (on_dask, THREADS)
    study = make_small_study(tmp_path / "moved", conditions())

    @contextmanager
    def until_some_are_stored(description: str, total: int) -> Iterator[Callable[[int], None]]:
        def stop(amount: int) -> None:
            if (study.directory / "assays").exists():
                raise KeyboardInterrupt

        yield stop

    with pytest.raises(KeyboardInterrupt):
        run_assays(
            study,
            find_missing_assays(study, ["innate"]),
            1,
            until_some_are_stored,
            ignore_message,
            executor=first,
        )
    kept = read_records(study.directory / "assays")
    run_assays(
        study,
        find_missing_assays(study, ["innate"]),
        2,
        ignore_progress,
        ignore_message,
        executor=second,
    )
    whole = read_records(measured(tmp_path / "whole", names=["innate"]).directory / "assays")
    assert 0 < len(kept) < len(whole) == len(conditions())
    assert read_records(study.directory / "assays") == whole
    assert kept.items() <= whole.items()


def test_a_damaged_record_is_named_wherever_it_is_read(tmp_path: Path, on_dask: Executor) -> None:
    study = make_small_study(tmp_path, [shorten_preset("evo/A")], runs=2)
    path = study.path("evo/A", 1)
    path.write_bytes(path.read_bytes()[:-1])
    for executor in (THREADS, on_dask):
        with pytest.raises(
            DamagedRecordError, match=r"0001\.nc is damaged: its checksum does not fit its content"
        ):
            run_assays(
                study,
                find_missing_assays(study, ["descent"]),
                2,
                ignore_progress,
                ignore_message,
                executor=executor,
            )


def test_workers_refuse_to_mix_engines(
    tmp_path: Path, on_dask: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask, "ENGINE", "engine-of-yesterday")
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=5)
    with pytest.raises(StudyError, match="has another version of baldwinlab or Numba"):
        list(amounts(on_dask, study, runs=2))


def test_workers_store_through_fsspec(tmp_path: Path, on_dask: Executor) -> None:
    study = create_study(
        parse_location(f"local://{tmp_path}/far"), [shorten_preset("evo/A")], seed=5
    )
    assert not isinstance(study.directory, Path)
    list(amounts(on_dask, study, runs=3))
    assert read_records(tmp_path / "far") == read_records(
        make_small_study(tmp_path / "near", [shorten_preset("evo/A")], runs=3).directory
    )


def test_a_scheduler_that_is_gone_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=5)
    with distributed.LocalCluster(
        n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as empty:
        steps = amounts(choose(f"dask:{empty.scheduler_address}"), study, runs=2)
        empty.loop.call_later(0.5, empty.close)
        monkeypatch.setattr(
            dask, "CONNECTION_TIMEOUT", 1
        )  # also seconds for which it is sought again
        with pytest.raises(ExecutorError, match="the connection to the Dask scheduler is lost"):
            next(steps)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["--executor", "treads"],
            "--executor treads must be threads, dask:tcp://HOST:PORT or slurm",
        ),
        (["--executor", "dask"], "--executor dask must be threads, dask:tcp://HOST:PORT or slurm"),
        (["--executor", "dask:127.0.0.1:8786"], "must be threads, dask:tcp://HOST:PORT or slurm"),
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
def test_what_cannot_be_used_is_refused_in_a_sentence(
    words: list[str],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(dask, "CONNECTION_TIMEOUT", 0.5)
    code, _, err = command(monkeypatch, capsys, tmp_path, "run", "evo/A", "--runs", "1", *words)
    assert code != 0
    assert sentence in err
    assert len(err.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_slurm_needs_to_know_what_a_job_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: f"/usr/bin/{name}")
    with pytest.raises(
        ValueError,
        match=r"needs jobqueue\.slurm\.cores and jobqueue\.slurm\.memory in Dask's configuration",
    ):
        choose("slurm", 2)


@pytest.mark.parametrize("module", ["distributed", "dask_jobqueue", "upath"])
def test_without_the_extra_threads_work_and_the_rest_names_it(
    module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    assert choose("threads", 3) == THREADS._replace(workers=3)
    for ask in (
        lambda: choose("dask:tcp://127.0.0.1:9"),
        lambda: choose("slurm", 2),
        lambda: parse_location("s3://bucket/study"),
    ):
        with pytest.raises(ValueError, match=re.escape(installation_command("cluster"))):
            ask()


def test_the_same_command_runs_on_a_cluster(
    tmp_path: Path, local: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "run",
        "evo/A",
        "--runs",
        "4",
        "--set",
        "evolution.generations=2",
        "--set",
        "lifetime.steps=60",
    ]
    far = ["--executor", f"dask:{local.scheduler_address}", "--out", "dask"]
    assert command(monkeypatch, capsys, tmp_path, *words, *far)[0] == 0
    assert command(monkeypatch, capsys, tmp_path, *words, "--out", "threads")[0] == 0
    assert read_records(tmp_path / "dask") == read_records(tmp_path / "threads") != {}
    (session,) = StudyStore(tmp_path / "dask").sessions()
    assert (session["executor"], session["workers"]) == ("dask", 2)
    assert (
        command(
            monkeypatch, capsys, tmp_path, "assay", "dask", "--assays", "innate,descent", *far[:2]
        )[0]
        == 0
    )
    assert (
        command(monkeypatch, capsys, tmp_path, "assay", "threads", "--assays", "innate,descent")[0]
        == 0
    )
    assert read_records(tmp_path / "dask") == read_records(tmp_path / "threads")


def test_a_study_and_its_report_may_lie_in_an_object_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    short = ["evolution.generations=2", "lifetime.steps=40"]
    words = ["run", "evo/A", "--runs", "2", "--set", *short, "--out", "memory://tests/paper"]
    assert command(monkeypatch, capsys, tmp_path, *words)[0] == 0
    code, out, _ = command(monkeypatch, capsys, tmp_path, "report", "memory://tests/paper")
    assert code == 0
    assert "report: memory://tests/paper/report.html" in out
    assert "<html" in parse_location("memory://tests/paper/report.html").read_text("utf-8")
    assert parse_location("memory://tests/paper/figures").exists()
    assert not list(tmp_path.iterdir())


def no_slurm() -> bool:
    return (
        not shutil.which("sinfo")
        or subprocess.run(["sinfo", "--noheader"], capture_output=True, timeout=20).returncode != 0
    )


@pytest.mark.skipif(no_slurm(), reason="no Slurm answers here; `make slurm` sets one up")
def test_slurm_jobs_do_a_study_to_the_bits_of_threads_though_one_is_cancelled(
    tmp_path: Path,
) -> None:
    words = [
        sys.executable,
        "-m",
        "baldwinlab",
        "run",
        "evo/A",
        "--runs",
        "200",
        "--set",
        "evolution.generations=20",
    ]
    job = {"DASK_JOBQUEUE__SLURM__CORES": "1", "DASK_JOBQUEUE__SLURM__MEMORY": "1GiB"}
    job |= {
        "PYTHONPATH": str(Path(__file__).parent.parent),
        "DASK_JOBQUEUE__SLURM__INTERFACE": "lo",
    }
    slurm = [*words, "--out", "slurm", "--executor", "slurm", "--workers", "2"]
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
    subprocess.run([*words, "--out", "threads"], cwd=tmp_path, env=os.environ | job, check=True)
    assert read_records(tmp_path / "slurm") == read_records(tmp_path / "threads")


def command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path, *words: str
) -> tuple[int, str, str]:
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "argv", ["baldwinlab", *words])
    try:
        cli.main()
        code = 0
    except SystemExit as end:
        code = int(end.code or 0)
    out, err = capsys.readouterr()
    return code, out, err
