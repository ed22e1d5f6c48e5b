"""A study on disk is written atomically, accepts no other study, and detects damaged records."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import pytest

import baldwinlab as bl
from baldwinlab.core.file_writing import identify_machine
from baldwinlab.papers.presets import load
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.records import DamagedRecordError, StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_file import add_checksum
from tests.small_studies import shorten_preset


def test_the_same_study_is_opened_and_a_different_study_is_refused(tmp_path: Path) -> None:
    experiments = [shorten_preset("evo/A"), shorten_preset("evo/B")]
    create_study(tmp_path, experiments, seed=1)
    assert create_study(tmp_path, experiments, seed=1).seed == 1
    with pytest.raises(StudyError, match="its seed is 1, not 2; choose another --out"):
        create_study(tmp_path, experiments, seed=2)
    with pytest.raises(StudyError, match="its conditions are evo/A, evo/B, not evo/A"):
        create_study(tmp_path, experiments[:1], seed=1)
    with pytest.raises(StudyError, match=r"learning\.rate of evo/B is 0\.01, not 0\.5"):
        create_study(
            tmp_path, [experiments[0], experiments[1].replace(learning={"rate": 0.5})], seed=1
        )


def test_a_directory_with_unknown_files_is_refused_and_not_changed(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(StudyError, match="is not empty and holds no study"):
        create_study(tmp_path, [load("evo/A")], seed=0)
    assert [entry.name for entry in tmp_path.iterdir()] == ["thesis.txt"]


def test_a_partially_created_study_can_be_created_again(tmp_path: Path) -> None:
    experiments = [shorten_preset("evo/A"), shorten_preset("evo/B")]
    create_study(tmp_path, experiments, seed=1)
    (tmp_path / "study.toml").unlink()
    with pytest.raises(StudyError, match="the beginning of another study"):
        create_study(tmp_path, [experiments[0].replace(learning={"rate": 0.5})], seed=1)
    assert list(create_study(tmp_path, experiments, seed=1).experiments) == ["evo/A", "evo/B"]


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["Evo/A", "evo/A"], "'Evo/A' and 'evo/A' differ only in capital letters"),
        (["con"], "no condition can be called 'con': Windows reserves 'con' for a device"),
        (
            ["evo/A", "NA"],
            "no condition can be called 'NA': tables are read with 'NA' as a missing",
        ),
        (["evo/AUX.1"], "Windows reserves 'AUX.1' for a device"),
        (["x."], "Windows removes the dot or space at the end of 'x.'"),
        (["x.NC"], "a study has files with such endings"),
        (["evo/A", "a/0000.nc"], "no condition can be called"),
        (["evo/A", "a/experiment.toml"], "no condition can be called"),
        (["evo/A", "evo/A"], "two conditions have the same name"),
    ],
)
def test_names_of_conditions_differ_and_are_folders_on_every_system(
    tmp_path: Path, names: list[str], message: str
) -> None:
    experiments = [load("evo/A").replace(name=name) for name in names]
    with pytest.raises(StudyError, match=re.escape(message)):
        create_study(tmp_path / "study", experiments, seed=0)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "holds no study"),
        ("seed = ", "cannot be read"),
        ("format = 3\nseed = 1", "cannot be read"),
        *(
            (
                text,
                rf"study\.toml cannot be read: it has format {number}, and this version reads only "
                "format 3; open it with the version that wrote it, or create the study again",
            )
            for text, number in [("", "None"), ("format = 2", 2), ("format = 9", 9)]
        ),
        ('format = 3\nseed = "0"\nconditions = []', "seed = '0': input should be a valid int"),
        ("format = 3\nseed = 2147483648", "seed = 2147483648: .* less than 2147483648"),
        ("format = 3\nfirst_run = -1", "first_run = -1: input should be greater than or equal"),
        ("format = 3\nseed = true", "seed = true: true and false are not numbers"),
        ("format = 3\npaper = 7", "paper = 7: must be a text; write it in quotes"),
        ("format = 3\nruns = 7", "runs: there is no such field; there are: kind, seed, cond"),
        ("format = 3\nseed = 1\nconditions = 5", "conditions = 5: input should be a list"),
        (
            'format = 3\nseed = 1\nconditions = ["../../etc"]',
            r"conditions\.0 = '\.\./\.\./etc': must be letters, digits",
        ),
        ('format = 3\nconditions = ["/etc"]', r"conditions\.0 = '/etc': must be letters"),
        (
            'format = 3\nseed = 1\nconditions = ["evo/A", "evo/A"]',
            "conditions = .*: must be a list of at least one name, with each name once",
        ),
        (f"seed = {'[' * 5000}{']' * 5000}", "cannot be read"),
    ],
)
def test_a_directory_that_is_not_a_study_is_refused_with_the_reason(
    tmp_path: Path, content: str | None, message: str
) -> None:
    if content is not None:
        (tmp_path / "study.toml").write_text(content)
    with pytest.raises(StudyError, match=message):
        StudyStore(tmp_path)


def test_an_invalid_experiment_of_a_study_is_named(tmp_path: Path) -> None:
    create_study(tmp_path, [shorten_preset("evo/A")], seed=1)
    path = tmp_path / "runs/evo/A/experiment.toml"
    path.write_text(add_checksum("nonsense = 1\n"))
    with pytest.raises(
        StudyError, match=r"experiment\.toml cannot be read: .*nonsense: there is no such field"
    ):
        StudyStore(tmp_path)


def test_a_missing_or_damaged_record_is_named(tmp_path: Path) -> None:
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=1)
    missing = r"0003\.nc does not exist; runs of evo/A that are stored: 0"
    with pytest.raises(StudyError, match=missing):
        study.read("evo/A", 3)
    study.path("evo/A", 3).write_bytes(b"CDF")
    with pytest.raises(DamagedRecordError, match=r"0003\.nc is damaged: it carries no checksum"):
        study.read("evo/A", 3)
    with pytest.raises(
        StudyError, match=r"has no condition 'evo/C' \(did you mean 'evo/A'\?\); there are evo/A"
    ):
        study.experiment("evo/C")


@pytest.mark.parametrize("command", ["run", "assay"])
def test_a_command_that_writes_removes_the_files_of_killed_writers(
    tmp_path: Path, command: str
) -> None:
    changes = {"evolution.generations": 2, "population.size": 10}
    options: dict[str, Any] = {"runs": 1, "out": tmp_path / "study", "set": changes}
    study = bl.run("hinton-nowlan-1987:guessing", **options)
    abandoned = tmp_path / "study" / "runs" / f".0066.nc.{identify_machine()}-1.partial"
    abandoned.touch()
    if command == "run":
        # All runs are stored already.
        bl.run("hinton-nowlan-1987:guessing", **options)
    else:
        study.assay("descent")
    assert not abandoned.exists()


@pytest.mark.parametrize("name", ["study.toml", "runs/evo/A/experiment.toml"])
@pytest.mark.parametrize("kind", ["a link", "a pipe", "a folder"])
def test_a_study_file_that_is_not_a_regular_file_is_refused(
    tmp_path: Path, name: str, kind: str
) -> None:
    create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=1)
    path = tmp_path / "study" / name
    path.rename(tmp_path / "moved.toml")
    if kind == "a link":
        path.symlink_to(tmp_path / "moved.toml")
    elif kind == "a pipe":
        os.mkfifo(path)
    else:
        path.mkdir()
    with pytest.raises(StudyError, match=f"{path.name} cannot be read: it is"):
        StudyStore(tmp_path / "study")


def test_invalid_lines_of_sessions_are_skipped(tmp_path: Path) -> None:
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=1)
    assert list(study.sessions()) == []
    session = {"seconds": 1.5, "compile_seconds": 0, "workers": 2, "agent_steps": 7}
    study.add_session(session)
    path = tmp_path / "sessions.jsonl"
    valid = path.read_bytes()
    lines = b'5\n{}\n[1]\n{"seconds": "long"}\n{"torn": \n' + b"[" * 100_000
    for invalid in (lines, b'{"seconds": 2', b"\xff\xfe", b'{"seconds": "\xe1"}', b"\0" * 100):
        path.write_bytes(invalid + b"\n" + valid + invalid)
        assert list(study.sessions()) == [session]


def test_a_study_cannot_be_created_inside_a_study(tmp_path: Path) -> None:
    create_study(tmp_path, [shorten_preset("evo/A")], seed=1)
    for folder in ("assays/innate/evil", "runs/evo/B", "paper/mine"):
        with pytest.raises(StudyError, match="is inside the study"):
            create_study(tmp_path / folder, [shorten_preset("evo/A")], seed=1)
    create_study(tmp_path / "multiverse", [shorten_preset("evo/A")], seed=1)
