"""The size of a file is checked before it is read: a sparse file of 20 GB raises a clear error."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from baldwinlab.core import files
from baldwinlab.core.files import FileKind, read_bytes, read_text
from baldwinlab.experiment import ExperimentError
from baldwinlab.papers import PaperError
from baldwinlab.papers import load as load_paper
from baldwinlab.papers.presets import load
from baldwinlab.parts import PartError, load_file
from baldwinlab.studies.records import DamagedRecordError, StudyError
from baldwinlab.studies.run import find_missing_runs
from baldwinlab.studies.sweeps import read_sweep as read_sweep
from tests.small_studies import ignore_message, make_small_study, shorten_preset

HUGE = 20 * 10**9
KINDS = [value for value in vars(files).values() if isinstance(value, FileKind)]


def test_a_file_is_read_up_to_the_size_of_its_kind(tmp_path: Path) -> None:
    kind = FileKind("a note", 5)
    path = tmp_path / "note"
    path.write_bytes(b"12345")
    assert read_bytes(path, kind) == b"12345"
    assert read_text(path, kind) == "12345"
    path.write_bytes(b"123456")
    with pytest.raises(ValueError, match="it has 6 bytes, and a note may have at most 5"):
        read_bytes(path, kind)


def test_the_size_limit_of_every_kind_of_file_fits_in_memory() -> None:
    assert len(KINDS) > 5
    assert all(0 < kind.max_bytes <= 4 * 2**30 for kind in KINDS)


READ = """
import os, resource, sys
from pathlib import Path
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.open import open_runs
resource.setrlimit(resource.RLIMIT_DATA, (2 * 10**9, 2 * 10**9))
folder = Path(sys.argv[1])
for name in sys.argv[2:]:
    size = (folder / name).stat().st_size
    os.truncate(folder / name, 20 * 10**9)
    try:
        list(StudyStore(folder).sessions())
        open_runs(folder)
    except BaldwinLabError as error:
        print(error)
    os.truncate(folder / name, size)
"""


@pytest.mark.skipif(
    not hasattr(resource, "RLIMIT_DATA"), reason="the system has no limit for the data of a process"
)
def test_an_oversized_file_of_a_study_is_reported_with_its_size_and_the_limit(
    tmp_path: Path,
) -> None:
    """The process has 2 GB of memory, so it cannot read the file."""
    make_small_study(tmp_path, [shorten_preset("evo/A")], runs=1)
    names = ["study.toml", "runs/evo/A/experiment.toml", "runs/evo/A/0000.nc", "sessions.jsonl"]
    result = subprocess.run(
        [sys.executable, "-c", READ, str(tmp_path), *names],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.stderr == ""
    for name, sentence in zip(names, result.stdout.splitlines(), strict=True):
        assert sentence.startswith(f"{tmp_path / name} ")
        assert "it has 20,000,000,000 bytes, and " in sentence
        assert " may have at most " in sentence


def test_an_oversized_record_is_moved_and_not_read(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, [shorten_preset("evo/A")], runs=1)
    os.truncate(study.path("evo/A", 0), HUGE)
    with pytest.raises(DamagedRecordError, match="a record of evo/A may have at most"):
        study.read("evo/A", 0)
    assert find_missing_runs(study, 1, ignore_message) == {"evo/A": [0]}
    assert (tmp_path / "runs" / "evo" / "A" / "0000.nc.damaged").stat().st_size == HUGE


@pytest.mark.parametrize("kind", ["huge", "pipe", "device"])
def test_an_input_that_is_oversized_or_not_a_file_is_refused_before_it_is_read(
    tmp_path: Path, kind: str
) -> None:
    experiment = tmp_path / "mine.toml"
    sweep = tmp_path / "sweep.toml"
    part = tmp_path / "part.py"
    (tmp_path / "paper").mkdir()
    paper = tmp_path / "paper" / "paper.toml"
    for path in (experiment, sweep, part, paper):
        if kind == "huge":
            path.write_bytes(b"")
            os.truncate(path, HUGE)
        elif kind == "pipe":
            os.mkfifo(path)
        else:
            path.symlink_to("/dev/zero")
    why = "it has 20,000,000,000 bytes" if kind == "huge" else "it is not a regular file"
    with pytest.raises(ExperimentError, match=f"cannot read {experiment}: {why}"):
        load(experiment)
    with pytest.raises(ExperimentError, match=f"cannot read {sweep}: {why}"):
        read_sweep(sweep)
    with pytest.raises(PartError, match=f"cannot read the part {part}: {why}"):
        load_file(part)
    with pytest.raises(PaperError, match=f"{paper} cannot be read: {why}"):
        load_paper(tmp_path / "paper")


def test_an_error_lists_at_most_ten_unknown_keys(tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    path.write_text("".join(f"key{number} = 1\n" for number in range(100_000)))
    with pytest.raises(ExperimentError) as raised:
        load(path)
    lines = str(raised.value).splitlines()
    assert len(lines) == 11
    assert lines[-1].endswith("and 99,990 more")


def test_a_sessions_path_that_is_not_a_file_is_reported(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, [shorten_preset("evo/A")], runs=1)
    (tmp_path / "sessions.jsonl").unlink()
    (tmp_path / "sessions.jsonl").mkdir()
    with pytest.raises(
        StudyError, match=r"sessions\.jsonl cannot be read: it is not a regular file"
    ):
        list(study.sessions())
