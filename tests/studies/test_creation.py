"""If processes create different studies in one directory, exactly one process succeeds."""

from __future__ import annotations

import multiprocessing
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest

from baldwinlab.core.file_writing import write_exclusively
from baldwinlab.core.files import parse_location
from baldwinlab.parts import Source
from baldwinlab.studies import creation
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_file import save_sources
from tests.small_studies import shorten_preset

ROUNDS = range(30)
CONDITION = "evo+self-taught/A"
PROCESSES = multiprocessing.get_context("spawn")
# By name: the seed and the learning rate that each of the two processes requests.
STUDIES = {
    "seeds": ((1, 0.1), (2, 0.1)),
    "experiments": ((1, 0.1), (1, 0.2)),
    "same": ((1, 0.1), (1, 0.1)),
}


def create_studies(process: int, folder: Path, barrier: Barrier) -> None:
    """Create the studies at the same time as a second process."""
    for name, requests in STUDIES.items():
        seed, rate = requests[process]
        experiment = shorten_preset(CONDITION).replace(learning={"rate": rate})
        for number in ROUNDS:
            barrier.wait()
            try:
                create_study(folder / f"{name}{number}", [experiment], seed)
                outcome = "created"
            except StudyError as error:
                outcome = str(error)
            (folder / f"{name}{number}.{process}").write_text(outcome)


@pytest.fixture(scope="module")
def race_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder in which two processes created studies and wrote the outcome of each."""
    folder = tmp_path_factory.mktemp("race")
    barrier = PROCESSES.Barrier(2)
    processes = [
        PROCESSES.Process(target=create_studies, args=(number, folder, barrier))
        for number in (0, 1)
    ]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
        assert process.exitcode == 0
    return folder


def outcomes(folder: Path, name: str) -> tuple[str, str]:
    return (folder / f"{name}.0").read_text(), (folder / f"{name}.1").read_text()


def test_exactly_one_of_two_processes_creates_a_study(race_folder: Path) -> None:
    for number in ROUNDS:
        winner = StudyStore(race_folder / f"seeds{number}").seed
        results = outcomes(race_folder, f"seeds{number}")
        assert results[winner - 1] == "created"
        assert f"holds another study: its seed is {winner}, not {3 - winner}" in results[2 - winner]
        rate = StudyStore(race_folder / f"experiments{number}").experiments[CONDITION].learning.rate
        results = outcomes(race_folder, f"experiments{number}")
        assert results[rate == 0.2] == "created"
        assert "another study" in results[rate != 0.2]
        assert outcomes(race_folder, f"same{number}") == ("created", "created")


def test_an_exclusive_write_does_not_replace_an_existing_file(tmp_path: Path) -> None:
    pytest.importorskip("upath")
    for path in (tmp_path / "study.toml", parse_location("memory://exclusive/study.toml")):
        write_exclusively(path, b"first")
        with pytest.raises(FileExistsError):
            write_exclusively(path, b"second")
        assert path.read_bytes() == b"first"
        assert [file.name for file in path.parent.iterdir()] == ["study.toml"]


def test_the_stored_source_of_a_part_is_not_replaced(tmp_path: Path) -> None:
    first, second = (Source("model", "mine", text, "mine.py") for text in ("a = 1", "a = 2"))
    save_sources(tmp_path, [first])
    save_sources(tmp_path, [first])
    with pytest.raises(StudyError, match=r"model-mine\.py exists with other content"):
        save_sources(tmp_path, [second])
    assert (tmp_path / "parts" / "model-mine.py").read_text() == "a = 1"


def test_an_experiment_with_a_setting_that_the_study_lacks_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    experiment = shorten_preset(CONDITION)
    create_study(tmp_path / "study", [experiment], 1)
    complete = experiment.to_dict()
    extended = complete | {"learning": complete["learning"] | {"delay": 3}}
    dicts = iter([complete, extended])
    monkeypatch.setattr(creation, "_describe_identity", lambda experiment: next(dicts))
    with pytest.raises(StudyError, match=r"learning\.delay of .* is not set, not 3"):
        create_study(tmp_path / "study", [experiment], 1)
