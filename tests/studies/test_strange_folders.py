"""A folder can hold pipes, huge files, links and names of any number. None of them does harm."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from baldwinlab.analysis.multiverse.analysis import read_multiverse
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import (
    PART_FILE,
    has_mark,
    open_file,
    read_bytes,
    require_writable,
)
from baldwinlab.evolution.genome_file import decode_genomes
from baldwinlab.lab import Lab
from baldwinlab.lab.sources.freezer import list_files
from baldwinlab.lab.sources.live import Live
from baldwinlab.lab.sources.studies import UNKNOWN_FILE, _find_source
from baldwinlab.studies.progress import FILE_PREFIX, ProcessProgress, read_progress
from baldwinlab.studies.record_files import StudyError
from baldwinlab.studies.status import read_status
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_file import PartRecord, add_checksum, stored_source
from tests.commands import Command
from tests.small_studies import make_small_study, shorten_preset
from tests.studies.completion import read_files


@pytest.fixture
def study(tmp_path: Path) -> Path:
    make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=1)
    return tmp_path / "study"


def test_a_pipe_is_refused_without_waiting_for_a_writer(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(ValueError, match="it is not a regular file"):
        open_file(pipe)
    with pytest.raises(ValueError, match="it is not a regular file"):
        has_mark(pipe, b"mark")
    for force in (False, True):
        with pytest.raises(RefusedError, match="is a device or a pipe"):
            require_writable("--out", pipe, b"mark", force=force)


def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "part.py"
    with path.open("wb") as file:
        file.truncate(60 * 2**30)
    with pytest.raises(ValueError, match=r"64,424,509,440 bytes, and .* at most 4,194,304"):
        read_bytes(path, PART_FILE)


@pytest.mark.parametrize("link", ["runs", "runs/evo/A"])
def test_no_file_of_another_study_is_removed_through_a_link(
    tmp_path: Path, study: Path, link: str
) -> None:
    other = tmp_path / "other"
    shutil.copytree(study, other)
    # A file of two runs is valid for no run if each run also has a file of its own.
    record = other / "runs/evo/A/0000.nc"
    shutil.copy(record, record.with_name("0001.nc"))
    shutil.copy(record, record.with_name("0000-0001.nc"))
    shutil.rmtree(study / link)
    (study / link).symlink_to(other / link)
    before = read_files(other)
    with pytest.raises(RefusedError, match="is a link that leads out of the study"):
        StudyStore(study).sweep()
    assert read_files(other) == before


def test_the_number_in_the_name_of_a_file_is_never_counted_to(
    study: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even a list of the missing runs would fill the memory, so the estimate refuses them."""
    (study / "runs/evo/A/2147483640.nc").write_text("x")
    refuse = "No list of the runs may be made."
    monkeypatch.setattr(
        "baldwinlab.api.run_study.set", lambda _: pytest.fail(refuse), raising=False
    )
    outcome = command("run", str(study))
    assert outcome.code == 2
    assert "2,147,483,641 runs" in outcome.err


def test_a_pipe_in_place_of_a_result_is_named(study: Path, command: Command) -> None:
    os.mkfifo(study / "baldwin.json")
    outcome = command("report", str(study), "--json")
    assert outcome.code == 2
    assert "baldwin.json cannot be read: it is not a regular file. Remove the file." in outcome.err


def test_the_lab_lists_a_folder_with_a_pipe(study: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "agents.nc")
    lab = Lab(tmp_path, Live())
    assert list_files(lab, {}) == {"files": []}
    part = PartRecord(kind="learning rule", name="foo", sha256="0" * 64)
    stored_source(study, part.kind, part.name).parent.mkdir()
    os.mkfifo(stored_source(study, part.kind, part.name))
    assert _find_source(lab, StudyStore(study), part) == UNKNOWN_FILE


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *[("pid", "x"), ("pid", 10**30), ("pid", 0), ("updated", "noon"), ("updated", 1e400)],
        *[("agent_steps", int("9" * 400)), ("runs", "abc"), ("workers", -1)],
    ],
)
def test_a_file_of_a_process_or_a_session_with_a_wrong_value_is_skipped(
    study: Path, key: str, value: object
) -> None:
    host = "another machine"
    progress = ProcessProgress(host, 7, 1.0, 2.0, 1, "threads", "cpu", runs=1, agent_steps=5)
    (study / f"{FILE_PREFIX}a-7.json").write_text(json.dumps(progress._asdict() | {key: value}))
    (study / f"{FILE_PREFIX}b-7.json").write_text(json.dumps(progress._asdict()))
    assert [process for _, process in read_progress(study)] == [progress]
    session = {"seconds": 1.0, "compile_seconds": 0.5, "workers": 1, "agent_steps": 3, "runs": 1}
    lines = [session, *([session | {key: value}] if key in session else []), [[]] * 3]
    text = "".join(f"{json.dumps(line)}\n" for line in lines) + "[" * 100_000
    (study / "sessions.jsonl").write_text(text)
    assert list(StudyStore(study).sessions()) == [session]
    read_status(StudyStore(study))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'conditions = ["evo/A"]',
            "conditions = []",
            r"conditions = .* at least one name",
        ),
        (
            'learner = "evo',
            'learner = [1, 2] # "evo',
            r"factors\.evo/A\.learner = \[1, 2\]: must be a text; write it in quotes",
        ),
        ("seed = ", "parts = 5\nseed = ", "parts = 5: input should be a list"),
        ("seed = ", 'parts = [{kind = "body"}]\nseed = ', r"parts\.0\.name: is missing"),
        ("[factors]", "", "factors: is missing"),
    ],
)
def test_a_wrong_value_in_study_toml_is_refused_with_file_and_key(
    study: Path, old: str, new: str, message: str
) -> None:
    path = study / "study.toml"
    text = path.read_text("utf-8").rpartition("# SHA-256")[0]
    assert old in text
    changed = text.replace(old, new) if new else text.partition(old)[0]
    path.write_text(add_checksum(changed), "utf-8")
    with pytest.raises(StudyError, match=f"study.toml cannot be read: {message}"):
        StudyStore(study)


@pytest.mark.parametrize("shape", ["1000000000000,", "1" + "0" * 30 + ","])
def test_a_short_file_that_declares_a_huge_array_is_refused(shape: str) -> None:
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({shape})}}".ljust(117) + "\n"
    content = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode()
    with pytest.raises(RefusedError, match=r"^huge\.npy is no genome file: "):
        decode_genomes(content, "huge.npy")


def test_deeply_nested_json_of_a_multiverse_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "multiverse.json"
    path.write_text("[" * 100_000 + "]" * 100_000, "utf-8")
    with pytest.raises(ValueError, match=r"multiverse\.json is not a file of .* not JSON"):
        read_multiverse(path)
