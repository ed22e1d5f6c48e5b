"""A study made with foreign parts: their sources are kept, readers need none of them, and who lives lives gives them again."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab import cli
from baldwinlab.experiment import registry
from baldwinlab.parts import PartError, load_file
from baldwinlab.studies.store import StudyStore
from tests.small_studies import read_records

FILE = Path(__file__).parents[2] / "examples" / "parts" / "bit_strings.py"
SMALL = {
    "bit_strings": {"loci": 6, "guesses": 50},
    "population": {"size": 40},
    "evolution": {"generations": 6},
}
OTHER = "mutated"  # by which a part is another


@pytest.fixture(autouse=True)
def nothing_stays() -> Iterator[None]:
    yield
    forget()


def forget() -> None:
    for kind, name in (("model", "bit-strings"), ("variation", "one-point")):
        registry.remove(kind, name)


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Of the model, with its part gone afterwards."""
    load_file(FILE)
    bl.run("bit-strings", runs=2, out=tmp_path / "mine", set=SMALL)
    forget()
    return tmp_path / "mine"


def refused(*words: str | Path) -> int:
    with pytest.raises(SystemExit) as ended:
        sys.argv = ["baldwinlab", *map(str, words)]
        cli.main()
    return int(ended.value.code or 0)


def test_a_study_keeps_name_source_and_hash_of_every_part(study: Path) -> None:
    text = FILE.read_bytes()
    stored = StudyStore(study).parts
    assert [(part.kind, part.name) for part in stored] == [
        ("model", "bit-strings"),
        ("variation", "one-point"),
    ]
    assert {part.sha256 for part in stored} == {sha256(text).hexdigest()}
    assert (study / "parts" / "model-bit-strings.py").read_bytes() == text


def test_readers_need_no_part(study: Path) -> None:
    data = bl.open_runs(study)
    assert data.energy.sizes == {"condition": 1, "run": 2, "generation": 6, "agent": 40}
    assert "food_eaten" not in data and data.unknown.notnull().all()
    found = bl.open_study(study)
    assert found.experiment("bit-strings").to_dict()["bit_strings"] == {
        "loci": 6,
        "guesses": 50,
        "guessing": True,
    }
    assert "Fitness of the best agent and of the average agent" in found.report().read_text()
    with pytest.raises(
        bl.ExperimentError,
        match="model = 'bit-strings' is a model that is not here: give it by --part FILE",
    ):
        _ = found.experiment("bit-strings").learns


def test_who_lives_lives_is_asked_for_the_part(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    digits = sha256(FILE.read_bytes()).hexdigest()[:12]
    assert refused("assay", study) == 2
    assert (
        f"the model 'bit-strings' of {study} (SHA-256 {digits}...) is not loaded; load its file with --part FILE"
        in _words(capsys)
    )
    with pytest.raises(PartError, match="is not loaded"):
        bl.open_study(study).replay("bit-strings", run=0, generation=1)


def test_another_part_of_that_name_is_refused(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "bit_strings.py"
    other.write_text(
        FILE.read_text().replace("guesses: int", f"{OTHER}: int = 1\n    guesses: int")
    )
    here, there = (sha256(path.read_bytes()).hexdigest()[:12] for path in (other, FILE))
    before = read_records(study)
    commands: list[list[str | Path]] = [
        ["assay", study],
        ["run", "bit-strings", "--runs", "3", "--out", study],
    ]
    for words in commands:
        assert refused(*words, "--part", other) == 2
        said = _words(capsys)
        assert f"(SHA-256 {there}...) differs from the loaded one ({here}...)" in said
    assert read_records(study) == before
    assert (
        bl.open_runs(study).energy.notnull().all()
    )  # to read it, it does not matter which is here


def test_given_again_the_part_carries_a_study_on_to_the_same_bits(
    study: Path, tmp_path: Path
) -> None:
    load_file(FILE)
    bl.run("bit-strings", runs=4, out=study, set=SMALL)
    bl.run("bit-strings", runs=4, out=tmp_path / "whole", set=SMALL, workers=1)
    assert read_records(study) == read_records(tmp_path / "whole")


def test_innate_and_learned_are_assayed_through_the_models_switches(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    load_file(FILE)
    innate = (
        bl.open_study(study)
        .assay("innate", "bit-strings")
        .energy.mean(("run", "generation", "agent"))
    )
    assert innate.sel(life="on") > innate.sel(life="off") >= 1
    assert innate.sel(life="frozen") >= innate.sel(
        life="on"
    )  # born with what it learned, an agent need not guess
    assert innate.sel(life="drift").isnull()  # which is of networks that teach themselves
    assert bl.open_study(study).assay("descent", "bit-strings").effective_ancestors.notnull().all()
    with pytest.raises(
        bl.StudyError,
        match="the assay reaction needs the model miniworld, not bit-strings",
    ):
        bl.open_study(study).assay("reaction")
    neutral = (
        bl.open_study(study)
        .assay("neutral", "bit-strings")
        .energy.mean(("run", "generation", "agent"))
        .sel(life="on")
    )
    assert neutral.sel(newborns="evolved") > neutral.sel(
        newborns="neutral control"
    )  # selection has built what is learned from
    forget()
    assert (
        bl.open_study(study).assay("innate", "bit-strings").energy.size
    )  # what is stored is read without the part
    report = bl.open_study(study).report().read_text()
    assert "the average agent gains" in report and "eats" not in report
    assert (
        "Does selection increase innate fitness?" in report
        and "Compared with the neutral control" in report
    )


def test_nothing_that_lies_in_a_study_is_executed(study: Path) -> None:
    for path in (study / "parts").iterdir():
        path.write_text("raise SystemExit('executed')")
    bl.open_study(study).report()
    load_file(FILE)
    bl.run("bit-strings", runs=3, out=study, set=SMALL)


def test_a_sweep_over_the_fields_of_a_part_opens_without_it(tmp_path: Path) -> None:
    load_file(FILE)
    plan = {
        "experiment": "bit-strings",
        "runs": 1,
        "fields": {"bit_strings.guesses": [5, 50], "evolution.selection": ["rank", "neutral"]},
    }
    plan["set"] = {"population.size": 40, "evolution.generations": 4}
    swept = bl.sweep(plan, out=tmp_path / "swept")
    forget()
    data = swept.data()
    assert data.sizes["bit_strings.guesses"] == 2 and data.energy.notnull().all()
    assert "share of agents with fitness above 0" in swept.report().read_text()


def test_dask_workers_are_sent_the_part(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    load_file(FILE)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as local:
        there = f"dask:{local.scheduler_address}"
        bl.run("bit-strings", runs=2, out=tmp_path / "dask", set=SMALL, executor=there).assay(
            "neutral", executor=there
        )
    bl.run("bit-strings", runs=2, out=tmp_path / "threads", set=SMALL).assay("neutral")
    assert read_records(tmp_path / "dask") == read_records(tmp_path / "threads")


def test_the_command_line_runs_a_model_of_ones_own(tmp_path: Path) -> None:
    bits = tmp_path / "bits.toml"
    bits.write_text(
        'name = "bits"\nmodel = "bit-strings"\n[population]\nsize = 30\n[evolution]\ngenerations = 3\n'
    )
    words = ["run", str(bits), "--part", str(FILE), "--runs", "1", "--out", str(tmp_path / "out")]
    done = subprocess.run(
        [sys.executable, "-m", "baldwinlab", *words], capture_output=True, text=True, env=os.environ
    )
    assert done.returncode == 0, done.stderr
    assert bl.open_study(tmp_path / "out").data().energy.sizes["generation"] == 3


def _words(capsys: pytest.CaptureFixture[str]) -> str:
    return " ".join(capsys.readouterr().err.split())
