"""The length of a study does not change during a simulation, and no record becomes shorter."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import Mock

import pytest

from baldwinlab.api.export.formats import study_formats, write_export
from baldwinlab.api.study import Study
from baldwinlab.core.console import errors
from baldwinlab.studies import status
from baldwinlab.studies.creation import extend_study
from baldwinlab.studies.progress import ProcessProgress
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.status import format_incomplete_sentence
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_length import change_length, hold_length
from tests.small_studies import (
    ignore_message,
    ignore_progress,
    make_small_study,
    read_records,
    shorten_preset,
)
from tests.studies.completion import complete_runs

CONDITION = "evo/A"
RUNS = 2
GENERATIONS = 5
# Holds the study in sys.argv[1] until its input ends.
HOLDING_PROCESS = """
import sys
from pathlib import Path
from baldwinlab.studies import study_length
from baldwinlab.studies.store import StudyStore
with getattr(study_length, sys.argv[2])(StudyStore(Path(sys.argv[1]))):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def study(tmp_path: Path) -> StudyStore:
    return make_small_study(tmp_path / "study", [shorten_preset(CONDITION)], RUNS)


def write_progress(study: StudyStore, host: str) -> None:
    """Write the file of a process that seems to simulate a study."""
    progress = ProcessProgress(host, os.getppid(), 0, time.time(), 1, "threads", "cpu", 1, 1)
    path = study.directory / progress.file_name
    path.write_text(json.dumps(progress._asdict()))


@contextmanager
def hold_in_another_process(study: StudyStore, name: str) -> Iterator[None]:
    """Call `hold_length` or `change_length` in another process."""
    command = [sys.executable, "-c", HOLDING_PROCESS, str(study.directory), name]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=environment) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield
        # The end of the input ends the process.
        process.communicate()


def test_a_study_is_not_extended_while_another_process_simulates_it(study: StudyStore) -> None:
    records = read_records(study.directory)
    with (
        hold_in_another_process(study, "hold_length"),
        pytest.raises(StudyError, match="cannot be extended now, because another process simul"),
    ):
        extend_study(study, GENERATIONS)
    assert StudyStore(study.directory).experiments == study.experiments
    assert read_records(study.directory) == records
    extend_study(study, GENERATIONS)


def test_a_study_is_not_simulated_while_another_process_extends_it(study: StudyStore) -> None:
    with (
        hold_in_another_process(study, "change_length"),
        pytest.raises(StudyError, match="another process is extending"),
        hold_length(study),
    ):
        pass


def test_processes_simulate_a_study_at_the_same_time(study: StudyStore) -> None:
    with hold_in_another_process(study, "hold_length"), hold_length(study):
        pass


def test_a_process_without_locks_is_found_by_its_progress(
    study: StudyStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("baldwinlab.core.file_writing.fcntl", None)
    with hold_in_another_process(study, "hold_length"):
        extend_study(study, GENERATIONS)
    write_progress(study, "node")
    with pytest.raises(StudyError, match=r"because the process \d+ on node simulates it"):
        extend_study(StudyStore(study.directory), GENERATIONS + 1)


def test_a_file_of_a_killed_process_does_not_prevent_an_extension(study: StudyStore) -> None:
    write_progress(study, socket.gethostname())
    extend_study(study, GENERATIONS)


def test_a_study_continues_with_the_runs_of_its_last_session(study: StudyStore) -> None:
    session = {"seconds": 1, "compile_seconds": 1, "workers": 1, "agent_steps": 1, "runs": 3}
    study.add_session(session)
    Study(study).extend()
    assert study.runs(CONDITION) == [0, 1, 2]


@pytest.mark.parametrize("context", [hold_length, change_length])
def test_a_study_that_was_extended_after_it_was_opened_is_refused(
    study: StudyStore, context: Callable[[StudyStore], object]
) -> None:
    extend_study(StudyStore(study.directory), GENERATIONS)
    with pytest.raises(StudyError, match=r"of evo/A in .* from 3 to 5. No record was changed"):
        context(study).__enter__()  # type: ignore[attr-defined]


def test_no_record_becomes_shorter_or_is_renamed(study: StudyStore) -> None:
    extended = extend_study(StudyStore(study.directory), GENERATIONS)
    complete_runs(extended, RUNS)
    records = read_records(study.directory)
    # `study` has the number of generations before the extension.
    with pytest.raises(StudyError, match="has 5 generations, and evo/A has 3"):
        find_missing_runs(study, RUNS, pytest.fail)
    with pytest.raises(StudyError, match="from 3 to 5"):
        run_study(study, {CONDITION: [*range(RUNS)]}, 1, ignore_progress, ignore_message)
    assert read_records(study.directory) == records


def test_incomplete_runs_are_named_where_runs_are_read(
    study: StudyStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not format_incomplete_sentence(study)
    extended = extend_study(study, GENERATIONS)
    complete_runs(extended, 1)
    formats = study_formats()
    sentence = format_incomplete_sentence(extended)
    assert sentence.startswith("1 of 2 stored runs have fewer generations than ")
    with pytest.raises(StudyError, match="1 of 2 stored runs have fewer generations"):
        Study(extended).assay("innate")
    with errors.capture() as messages:
        text = write_export(formats, formats["csv"], extended, tmp_path / "a.csv", {}, force=False)
        assert text.endswith("a.csv: 2 runs; the study has incomplete runs")
        Study(extended).data()
        count_stored_runs = Mock(wraps=status.count_stored_runs)
        monkeypatch.setattr(status, "count_stored_runs", count_stored_runs)
        Study(extended).report(tmp_path / "a.html")
    # The files of the only condition are read once.
    assert count_stored_runs.call_count == 1
    assert messages.get().count("1 of 2 stored runs have fewer generations") == 3
    assert "1 of 2 stored runs have fewer generations" in (tmp_path / "a.html").read_text()
