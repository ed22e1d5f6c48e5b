"""A refused command leaves nothing on disk, even if it is refused late."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from baldwinlab.core.errors import InterruptedStudyError, RefusedError
from baldwinlab.core.files import parse_location
from baldwinlab.studies.creation import remove_if_refused
from tests.commands import Command
from tests.small_studies import make_small_study

# Parts whose faults are found after the study is created.
PARTS = {
    "uncompiled.py": """
from baldwinlab.parts import Fitness

class Uncompiled(Fitness, name="uncompiled"):
    \"""A fitness whose code uses an undefined name.\"""
    @staticmethod
    def evaluate(part, lifetimes, fitness):
        fitness[:] = undefined_name
""",
    "no_number.py": """
import numpy as np
from baldwinlab.parts import Fitness

class NoNumber(Fitness, name="no-number"):
    \"""A fitness that is no number.\"""
    @staticmethod
    def evaluate(part, lifetimes, fitness):
        fitness[:] = np.nan
""",
}
SHORT = ("lifetime.steps=20", "evolution.generations=2")
SWEEP = """
experiment = "evo/A"
runs = 1
set = {{ "lifetime.steps" = 20, "evolution.generations" = 2, "evolution.fitness" = "{fitness}" }}
fields = {{ "motor.noise" = [0.1, 0.2] }}
"""
RUN = "run evo/A --runs 1 --out a/new"
LATE = [
    f"{RUN} --part uncompiled.py --set evolution.fitness=uncompiled {' '.join(SHORT)}",
    f"{RUN} --part no_number.py --set evolution.fitness=no-number {' '.join(SHORT)}",
    f"run evo/A --part uncompiled.py --set evolution.fitness=uncompiled {' '.join(SHORT)}",
    f"{RUN} --part uncompiled.py --set evolution.fitness=uncompiled --founders base:evo/A@1",
    f"{RUN} --founders wrong.npy",
    f"{RUN} --founders base:evo/A@9",
    f"{RUN} --founders base:evo/A@1 --executor nowhere",
    f"{RUN} --founders base:evo/A@1 --checkpoint often",
    "run evo/A --runs 1 --out base/runs/new",
    "sweep uncompiled.toml --part uncompiled.py",
    "sweep uncompiled.toml --part uncompiled.py --out a/new",
    "reproduce hinton-nowlan-1987 --runs 1 --out a/new --part uncompiled.py "
    "--set evolution.fitness=uncompiled population.size=4 evolution.generations=2",
    "reproduce many-learning-rules --quick --out a/new --variant rank",
    "multiverse le-2019 --runs 1 --out a/new --checkpoint often",
    "multiverse le-2019 --runs 1 --out a/new --executor nowhere",
    "assay base --assays innate --executor nowhere",
    "run base --generations 9 --executor nowhere",
    "export base --format onnx --run 0 --generation 9 --agent 0 --out network.onnx",
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("folder")
    make_small_study(folder / "base", runs=1)
    for name, text in PARTS.items():
        (folder / name).write_text(text)
    (folder / "uncompiled.toml").write_text(SWEEP.format(fitness="uncompiled"))
    genomes = np.zeros((20, 60), np.float32)
    genomes[3, 5] = np.nan
    np.save(folder / "wrong.npy", genomes)
    return folder


def read_tree(folder: Path) -> dict[str, bytes | None]:
    """Return all files with their content, and all folders."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


@pytest.mark.parametrize("words", LATE)
def test_a_command_that_is_refused_late_leaves_nothing(
    command: Command, folder: Path, tmp_path: Path, words: str
) -> None:
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    before = read_tree(tmp_path)
    outcome = command(*words.split())
    assert outcome.code not in (0, None), outcome.out
    assert "baldwinlab: " in outcome.err
    assert read_tree(tmp_path) == before


@pytest.mark.parametrize("directory", ["new", "a/b/new", "empty"])
def test_only_added_files_are_removed(tmp_path: Path, directory: str) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "other.txt").write_text("content")
    before = read_tree(tmp_path)
    with pytest.raises(RefusedError), remove_if_refused(tmp_path / directory):
        (tmp_path / directory / "runs" / "evo").mkdir(parents=True)
        (tmp_path / directory / "study.toml").write_text("")
        raise RefusedError
    assert read_tree(tmp_path) == before


@pytest.mark.parametrize("name", ["runs/0000.nc", "runs/0000.checkpoint", ".running-a-1.json"])
def test_a_study_with_results_or_of_another_process_remains(tmp_path: Path, name: str) -> None:
    with pytest.raises(RefusedError), remove_if_refused(tmp_path / "new"):
        (tmp_path / "new" / "runs").mkdir(parents=True)
        (tmp_path / "new" / "study.toml").write_text("")
        (tmp_path / "new" / name).write_text("")
        raise RefusedError
    assert (tmp_path / "new" / "study.toml").exists()


@pytest.mark.parametrize("error", [InterruptedStudyError, KeyboardInterrupt])
def test_an_interrupted_study_remains(tmp_path: Path, error: type[BaseException]) -> None:
    with pytest.raises(error), remove_if_refused(tmp_path / "new"):
        (tmp_path / "new").mkdir()
        (tmp_path / "new" / "study.toml").write_text("")
        raise error
    assert (tmp_path / "new" / "study.toml").exists()


def test_a_refused_study_in_remote_storage_leaves_nothing() -> None:
    directory = parse_location("memory://refused/new")
    with pytest.raises(RefusedError), remove_if_refused(directory):
        (directory / "runs").mkdir(parents=True, exist_ok=True)
        (directory / "study.toml").write_bytes(b"")
        (directory / "runs" / "experiment.toml").write_bytes(b"")
        raise RefusedError
    assert not [path for path in directory.rglob("*") if path.is_file()]
