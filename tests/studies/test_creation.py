"""Of several processes that create different studies in one directory, one succeeds."""

from __future__ import annotations

import multiprocessing
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest

from baldwinlab.core.errors import PartError
from baldwinlab.core.file_writing import write_exclusively
from baldwinlab.core.files import parse_location
from baldwinlab.parts import Source
from baldwinlab.studies import part_sources
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_file import add_checksum
from tests.small_studies import shorten_preset

ROUNDS = range(30)
CONDITION = "evo+self-taught/A"
PROCESSES = multiprocessing.get_context("spawn")
STUDIES = {  # by name: the seed and the learning rate that each of two processes asks for
    "seeds": ((1, 0.1), (2, 0.1)),
    "experiments": ((1, 0.1), (1, 0.2)),
    "same": ((1, 0.1), (1, 0.1)),
}


def create_studies(process: int, folder: Path, start: Barrier) -> None:
    """In a process of its own: create the studies at the same moments as the other process."""
    for name, wanted in STUDIES.items():
        seed, rate = wanted[process]
        experiment = shorten_preset(CONDITION).replace(learning={"rate": rate})
        for number in ROUNDS:
            start.wait()
            try:
                create_study(folder / f"{name}{number}", [experiment], seed)
                outcome = "created"
            except StudyError as error:
                outcome = str(error)
            (folder / f"{name}{number}.{process}").write_text(outcome)


@pytest.fixture(scope="module")
def race(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which two processes have created studies, and noted what came of each."""
    folder, start = tmp_path_factory.mktemp("race"), PROCESSES.Barrier(2)
    processes = [
        PROCESSES.Process(target=create_studies, args=(number, folder, start)) for number in (0, 1)
    ]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
        assert process.exitcode == 0
    return folder


def outcomes(folder: Path, name: str) -> tuple[str, str]:
    return (folder / f"{name}.0").read_text(), (folder / f"{name}.1").read_text()


def test_of_two_processes_with_different_seeds_one_is_refused(race: Path) -> None:
    for number in ROUNDS:
        winner = StudyStore(race / f"seeds{number}").seed
        ended = outcomes(race, f"seeds{number}")
        assert ended[winner - 1] == "created"
        assert f"holds another study: its seed is {winner}, not {3 - winner}" in ended[2 - winner]


def test_of_two_processes_with_different_experiments_one_is_refused(race: Path) -> None:
    for number in ROUNDS:
        rate = StudyStore(race / f"experiments{number}").experiments[CONDITION].learning.rate
        ended = outcomes(race, f"experiments{number}")
        assert ended[rate == 0.2] == "created"
        assert "another study" in ended[rate != 0.2]


def test_two_processes_with_the_same_study_both_succeed(race: Path) -> None:
    for number in ROUNDS:
        assert outcomes(race, f"same{number}") == ("created", "created")


def test_a_file_that_exists_is_never_written_exclusively(tmp_path: Path) -> None:
    pytest.importorskip("upath")
    for place in (tmp_path / "study.toml", parse_location("memory://exclusive/study.toml")):
        write_exclusively(place, b"first")
        with pytest.raises(FileExistsError):
            write_exclusively(place, b"second")
        assert place.read_bytes() == b"first"
        assert [path.name for path in place.parent.iterdir()] == ["study.toml"]


def test_the_source_of_a_part_in_a_study_that_is_being_created_is_not_replaced(
    tmp_path: Path,
) -> None:
    first, second = (Source("model", "mine", text, "mine.py") for text in ("a = 1", "a = 2"))
    part_sources.save_sources(tmp_path, [first])
    part_sources.save_sources(tmp_path, [first])
    with pytest.raises(PartError, match=r"model-mine\.py is there already and holds another part"):
        part_sources.save_sources(tmp_path, [second])
    assert (tmp_path / "parts" / "model-mine.py").read_text() == "a = 1"


def test_a_name_that_stands_twice_in_a_study_is_refused(tmp_path: Path) -> None:
    path = create_study(tmp_path, [shorten_preset("evo/A")], seed=1).directory / "study.toml"
    above = path.read_text().split("# SHA-256")[0]
    path.write_text(add_checksum(above.replace('["evo/A"]', '["evo/A", "evo/A"]')))
    with pytest.raises(StudyError, match="conditions: a name is listed twice"):
        StudyStore(tmp_path)
