"""A command killed at any time leaves valid files, and resumes with identical results."""

from __future__ import annotations

import multiprocessing
import os
import random
import shutil
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import pytest

from baldwinlab.core.netcdf import from_bytes, verify_checksum
from baldwinlab.core.variables import RUN_ARRAY_PREFIX
from baldwinlab.simulation.history import History
from baldwinlab.studies.checkpoints import Checkpointer
from baldwinlab.studies.store import StudyStore
from tests.faults import amount

SMALL = ("--set", "evolution.generations=6", "lifetime.steps=2000", "world.start.x=380")
RUN = ("run", "evo/A", "evo+self-taught/A", *SMALL, "--runs", "12", "--out", "study")
# The archive of novelty is an array of the run.
NOVELTY = (
    *("run", "evo/A", "--runs", "1", "--checkpoint", "1", "--out", "study"),
    *("--set", "evolution.fitness=novelty", "evolution.generations=60", "lifetime.steps=1000"),
)
CHECKPOINT = "study/runs/evo/A/0000.checkpoint"
ARCHIVE_SIZE = f"{RUN_ARRAY_PREFIX}0.fitness.novelty.n_archived"
LIFETIME = ("--condition", "evo/A", "--run", "0", "--generation", "5")
SWEEP = """
experiment = "evo+self-taught/A"
runs = 6
set = { lifetime.steps = 1000, evolution.generations = 4, world.start.x = 380 }
fields = { learning.rate = [0, 0.01, 0.02] }
"""


class Stage(NamedTuple):
    """A command to kill, and the command that prepares its folder."""

    name: str
    command: tuple[str, ...]
    kills: int
    before: tuple[str, ...] = ()
    environment: Mapping[str, str] = MappingProxyType({})


STAGES = [
    Stage("run", RUN, 165),
    # Each generation stores a checkpoint.
    Stage("checkpoint", (*RUN, "--checkpoint", "1"), 40),
    Stage("extend", ("run", "study", "--generations", "9"), 40, RUN),
    Stage("sweep", ("sweep", "sweep.toml", "--out", "study"), 35),
    Stage("assay", ("assay", "study", "--assays", "innate"), 15, RUN),
    Stage("report", ("report", "study"), 20, RUN),
    Stage("trace", ("replay", "study", *LIFETIME, "--out", "life.nc"), 45, RUN),
    Stage("movie", ("replay", "study", *LIFETIME, "--out", "life.gif"), 10, RUN),
    # The cache of compiled code is empty.
    Stage("compile", RUN, 10, environment={"BALDWINLAB_CACHE": "cache"}),
]


def run_command(command: tuple[str, ...], folder: Path, environment: Mapping[str, str]) -> None:
    """Run a command in this process. Standard output and error go to the file "output"."""
    os.environ.update(environment)
    os.chdir(folder)
    output = os.open("output", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 1)
    os.dup2(output, 2)
    sys.argv = ["baldwinlab", *command]
    # The package reads the environment when it is imported.
    from baldwinlab.__main__ import main

    main()


# Most processes are forked from a process that has imported the package. Otherwise most kills
# would happen during the imports.
FORKED = multiprocessing.get_context("forkserver")
FORKED.set_forkserver_preload(
    [
        "baldwinlab.cli",
        "baldwinlab.api.report",
        "baldwinlab.api.run_study",
        "baldwinlab.analysis.movie",
    ]
)
SPAWNED = multiprocessing.get_context("spawn")


def run_until_archived(
    command: tuple[str, ...], folder: Path, environment: Mapping[str, str]
) -> None:
    """Run a command until its checkpoint contains an archive, and wait for the kill."""
    save = Checkpointer.save

    def save_and_wait(checkpointer: Checkpointer, histories: Sequence[History]) -> None:
        save(checkpointer, histories)
        if read_number_of_behaviors(folder / CHECKPOINT):
            threading.Event().wait()

    pytest.MonkeyPatch().setattr(Checkpointer, "save", save_and_wait)
    run_command(command, folder, environment)


def start_process(
    command: tuple[str, ...],
    folder: Path,
    environment: Mapping[str, str],
    run: Callable[[tuple[str, ...], Path, Mapping[str, str]], None] = run_command,
) -> BaseProcess:
    process: BaseProcess = (SPAWNED if environment else FORKED).Process(
        target=run, args=(command, folder, dict(environment))
    )
    process.start()
    return process


def finish(command: tuple[str, ...], folder: Path, environment: Mapping[str, str]) -> float:
    """Run a command to its end and return its duration in seconds."""
    started_at = time.monotonic()
    process = start_process(command, folder, environment)
    process.join()
    assert process.exitcode == 0, (folder / "output").read_text()
    return time.monotonic() - started_at


def reproducible_files(folder: Path) -> dict[str, bytes]:
    """Return the content of all files that are reproducible, by path."""
    paths = (
        path
        for path in sorted(folder.rglob("*"))
        if path.suffix in (".nc", ".csv", ".json", ".gif", ".toml")
    )
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in paths
        if not path.name.startswith(".")
    }


def require_sound(folder: Path, before: dict[str, bytes], expected: dict[str, bytes]) -> None:
    """Require that each file has its content from before the command, or its final content."""
    for name, content in reproducible_files(folder).items():
        # An exported trace has no checksum.
        if name.startswith("study/") and name.endswith(".nc"):
            verify_checksum(content)
        assert name not in expected or content in (before.get(name), expected[name]), name
    for page in folder.rglob("*.html"):
        assert page.read_text().rstrip().endswith("</html>")
    if (folder / "study/study.toml").exists():
        study = StudyStore(folder / "study")
        for condition in study.experiments:
            for run in study.runs(condition):
                study.record(condition, run)


@pytest.fixture(scope="module")
def finished_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a finished study."""
    folder = tmp_path_factory.mktemp("base")
    finish(RUN, folder, {})
    return folder


def prepare_folder(stage: Stage, finished_study: Path, folder: Path) -> Path:
    """Create the folder in which a stage starts."""
    shutil.rmtree(folder, ignore_errors=True)
    if stage.before:
        shutil.copytree(finished_study, folder)
    else:
        folder.mkdir()
        (folder / "sweep.toml").write_text(SWEEP)
    return folder


def kill_repeatedly(stage: Stage, finished_study: Path, tmp_path: Path, kills: int) -> None:
    """Kill a stage at random times and resume it. Start again in a new folder when it ends."""
    seconds = finish(
        stage.command,
        prepare_folder(stage, finished_study, tmp_path / "expected"),
        stage.environment,
    )
    expected = reproducible_files(tmp_path / "expected")
    folder = prepare_folder(stage, finished_study, tmp_path / "killed")
    before = reproducible_files(folder)
    random_times = random.Random(stage.name)
    killed = 0
    while killed < kills:
        process = start_process(stage.command, folder, stage.environment)
        process.join(random_times.uniform(0, seconds))
        if process.exitcode is None:
            process.kill()
            process.join()
            require_sound(folder, before, expected)
            killed += 1
        else:
            assert process.exitcode == 0, (folder / "output").read_text()
            assert reproducible_files(folder) == expected
            prepare_folder(stage, finished_study, folder)
    finish(stage.command, folder, stage.environment)
    assert reproducible_files(folder) == expected


# In `make test`, the tests of batches kill processes that store runs.
@pytest.mark.skipif(amount(1, 0) == 0, reason="`make faults` kills commands")
@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: stage.name)
def test_a_killed_command_loses_no_stored_result(
    stage: Stage, finished_study: Path, tmp_path: Path
) -> None:
    kill_repeatedly(stage, finished_study, tmp_path, stage.kills)


@pytest.mark.nightly
def test_a_killed_run_continues_with_its_archive(tmp_path: Path) -> None:
    expected, killed = tmp_path / "expected", tmp_path / "killed"
    for folder in (expected, killed):
        folder.mkdir()
    finish(NOVELTY, expected, {})
    process = start_process(NOVELTY, killed, {}, run_until_archived)
    while read_number_of_behaviors(killed / CHECKPOINT) == 0:
        assert process.exitcode is None
        time.sleep(0.005)
    process.kill()
    process.join()
    finish(NOVELTY, killed, {})
    assert reproducible_files(killed) == reproducible_files(expected)
    record = StudyStore(killed / "study").record("evo/A", 0)
    assert record[ARCHIVE_SIZE].item() > 0


def read_number_of_behaviors(path: Path) -> int:
    """Return the number of positions in the archive of a checkpoint, if it exists."""
    if not path.exists():
        return 0
    # The first checkpoint begins without arrays of the run.
    size = from_bytes(path.read_bytes()).get(ARCHIVE_SIZE)
    return 0 if size is None else int(size.item())
