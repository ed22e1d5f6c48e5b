"""Whatever is killed, whenever: what lies there is sound, and the same command carries on to the same bits."""

from __future__ import annotations

import multiprocessing
import os
import random
import shutil
import sys
import time
from collections.abc import Mapping
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import pytest

from baldwinlab.core.netcdf import verify
from baldwinlab.studies.store import StudyStore
from tests.faults.amount import amount

SMALL = (
    "--set",
    "evolution.generations=6",
    "--set",
    "lifetime.steps=2000",
    "--set",
    "world.start.x=380",
)
RUN = ("run", "evo/A", "evo+self-taught/A", *SMALL, "--runs", "12", "--out", "study")
LIFE = ("--condition", "evo/A", "--run", "0", "--generation", "5")
SWEEP = """
experiment = "evo+self-taught/A"
runs = 6
set = { lifetime.steps = 1000, evolution.generations = 4, world.start.x = 380 }
fields = { learning.rate = [0, 0.01, 0.02] }
"""


class Stage(NamedTuple):
    """A command that is killed, after others have made what it needs."""

    name: str
    command: tuple[str, ...]
    kills: int
    before: tuple[str, ...] = ()
    environment: Mapping[str, str] = MappingProxyType({})


STAGES = [
    Stage("run", RUN, 165),
    Stage("sweep", ("sweep", "sweep.toml", "--out", "study"), 35),
    Stage("assay", ("assay", "study", "--assays", "innate"), 15, RUN),
    Stage("report", ("report", "study"), 20, RUN),
    Stage("trace", ("replay", "study", *LIFE, "--out", "life.nc"), 45, RUN),
    Stage("movie", ("replay", "study", *LIFE, "--out", "life.gif"), 10, RUN),
    Stage(
        "compile", RUN, 10, environment={"BALDWINLAB_CACHE": "cache"}
    ),  # which begins without any compiled code
]


def live(command: tuple[str, ...], folder: Path, environment: Mapping[str, str]) -> None:
    """The command, in a process of its own."""
    os.environ.update(environment)
    os.chdir(folder)
    told = os.open("told", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(told, 1)
    os.dup2(told, 2)
    sys.argv = ["baldwinlab", *command]
    from baldwinlab.__main__ import main  # here, where the environment is what it is to be

    main()


# Most processes are forked from one that has loaded what a command loads, or most kills would meet nothing but that.
FORKED = multiprocessing.get_context("forkserver")
FORKED.set_forkserver_preload(
    [
        "baldwinlab.cli",
        "baldwinlab.api.report",
        "baldwinlab.api.run_study",
        "baldwinlab.analysis.movie",
    ]
)
FRESH = multiprocessing.get_context("spawn")


def begin(command: tuple[str, ...], folder: Path, environment: Mapping[str, str]) -> BaseProcess:
    process: BaseProcess = (FRESH if environment else FORKED).Process(
        target=live, args=(command, folder, dict(environment))
    )
    process.start()
    return process


def finish(command: tuple[str, ...], folder: Path, environment: Mapping[str, str]) -> float:
    """Seconds that it took."""
    began = time.monotonic()
    process = begin(command, folder, environment)
    process.join()
    assert process.exitcode == 0, (folder / "told").read_text()
    return time.monotonic() - began


def made(folder: Path) -> dict[str, bytes]:
    """All that has the same bits each time."""
    kept = (
        path
        for path in sorted(folder.rglob("*"))
        if path.suffix in (".nc", ".csv", ".json", ".gif", ".toml")
    )
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in kept
        if not path.name.startswith(".")
    }


def require_sound(folder: Path, whole: dict[str, bytes]) -> None:
    """Nothing half-written has the name of something whole."""
    for name, content in made(folder).items():
        if name.startswith("study/") and name.endswith(
            ".nc"
        ):  # a trace of a user's own carries no checksum
            verify(content)
        assert name not in whole or content == whole[name], name
    for page in folder.rglob("*.html"):
        assert page.read_text().rstrip().endswith("</html>")
    if (folder / "study/study.toml").exists():
        study = StudyStore(folder / "study")
        for condition in study.experiments:
            for run in study.runs(condition):
                study.record(condition, run)


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a finished study."""
    folder = tmp_path_factory.mktemp("base")
    finish(RUN, folder, {})
    return folder


def fresh(stage: Stage, base: Path, folder: Path) -> Path:
    """The folder in which a stage begins."""
    shutil.rmtree(folder, ignore_errors=True)
    if stage.before:
        shutil.copytree(base, folder)
    else:
        folder.mkdir()
        (folder / "sweep.toml").write_text(SWEEP)
    return folder


def kill_again_and_again(stage: Stage, base: Path, tmp_path: Path, kills: int) -> None:
    """Kill a stage at random moments, carrying on where the last was killed; begin anew when it has come to its end."""
    seconds = finish(stage.command, fresh(stage, base, tmp_path / "whole"), stage.environment)
    whole, folder = made(tmp_path / "whole"), fresh(stage, base, tmp_path / "killed")
    moments, killed = random.Random(stage.name), 0
    while killed < kills:
        process = begin(stage.command, folder, stage.environment)
        process.join(moments.uniform(0, seconds))
        if process.exitcode is None:
            process.kill()
            process.join()
            require_sound(folder, whole)
            killed += 1
        else:
            assert process.exitcode == 0, (folder / "told").read_text()
            assert made(folder) == whole
            fresh(stage, base, folder)
    finish(stage.command, folder, stage.environment)
    assert made(folder) == whole


def of(stage: Stage) -> Any:
    """A stage as a case of a test; of all stages, `make test` kills a run alone."""
    whole_suite = pytest.mark.skipif(
        amount(1, 0) == 0 and stage.name != "run", reason="`make faults` kills it"
    )
    return pytest.param(stage, id=stage.name, marks=whole_suite)


@pytest.mark.parametrize("stage", [of(stage) for stage in STAGES])
def test_what_is_killed_loses_nothing_that_was_stored(
    stage: Stage, base: Path, tmp_path: Path
) -> None:
    kill_again_and_again(stage, base, tmp_path, amount(stage.kills, 1))
