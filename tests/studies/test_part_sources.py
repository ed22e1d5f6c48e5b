"""A study with third-party parts stores their sources and can be read without them.

Commands that simulate need the same parts again.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab.experiment import registry
from baldwinlab.parts import PartError, load_file
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.small_studies import read_records

FILE = Path(__file__).parents[2] / "examples" / "parts" / "bit_strings.py"
SMALL = {
    "bit_strings": {"loci": 6, "guesses": 50},
    "population": {"size": 40},
    "evolution": {"generations": 6},
}
# A field that makes a part different from the stored one.
EXTRA_FIELD = "mutated"


@pytest.fixture(autouse=True)
def remove_parts() -> Iterator[None]:
    yield
    remove_loaded_parts()


def remove_loaded_parts() -> None:
    for kind, name in (("model", "bit-strings"), ("variation", "one-point")):
        registry.remove(kind, name)


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Return the directory of a study of the model. The part is no longer loaded."""
    load_file(FILE)
    bl.run("bit-strings", runs=2, out=tmp_path / "mine", set=SMALL)
    remove_loaded_parts()
    return tmp_path / "mine"


def test_a_study_stores_the_name_source_and_hash_of_every_part(study: Path) -> None:
    text = FILE.read_bytes()
    stored = StudyStore(study).parts
    assert [(part.kind, part.name) for part in stored] == [
        ("model", "bit-strings"),
        ("variation", "one-point"),
    ]
    assert {part.sha256 for part in stored} == {sha256(text).hexdigest()}
    assert (study / "parts" / "model-bit-strings.py").read_bytes() == text


def test_a_study_can_be_read_without_its_part(study: Path) -> None:
    data = bl.open_study(study).data()
    assert data.energy.sizes == {"condition": 1, "run": 2, "generation": 6, "agent": 40}
    assert "food_eaten" not in data
    assert data.unknown.notnull().all()
    opened = bl.open_study(study)
    assert opened.experiment("bit-strings").to_dict()["bit_strings"] == {
        "loci": 6,
        "guesses": 50,
        "guessing": True,
    }
    assert "Fitness of the best agent and the average agent" in opened.report().read_text()
    with pytest.raises(
        bl.ExperimentError,
        match="model = 'bit-strings' is a model that is not loaded: load it with --part FILE",
    ):
        _ = opened.experiment("bit-strings").learns


def test_commands_that_simulate_require_the_part(study: Path, command: Command) -> None:
    result = command("assay", str(study))
    assert result.code == 2
    message = " ".join(result.err.split())
    assert f"the model 'bit-strings' of {study.name} is not loaded; load its file" in message
    # The remedy works if it is pasted.
    remedy = shlex.split(message.partition("in the study: ")[2])
    assert command("assay", str(study), "--assays", "innate", *remedy).code == 0
    remove_loaded_parts()
    with pytest.raises(PartError, match="is not loaded"):
        bl.open_study(study).replay("bit-strings", run=0, generation=1)


def test_a_different_part_of_the_same_name_is_refused(
    study: Path, tmp_path: Path, command: Command
) -> None:
    changed = tmp_path / "bit_strings.py"
    changed.write_text(
        FILE.read_text().replace("guesses: int", f"{EXTRA_FIELD}: int = 1\n    guesses: int")
    )
    before = read_records(study)
    run = ("run", "bit-strings", "--runs", "3", "--out", str(study))
    for arguments in (("assay", str(study)), run):
        result = command(*arguments, "--part", str(changed))
        assert result.code == 2
        message = " ".join(result.err.split())
        assert (
            f"'bit-strings' of {study.name} differs from the loaded one; choose another" in message
        )
    assert read_records(study) == before
    # Reading does not depend on the loaded part.
    assert bl.open_study(study).data().energy.notnull().all()


def test_a_study_resumes_with_the_same_part_and_gives_identical_records(
    study: Path, tmp_path: Path
) -> None:
    load_file(FILE)
    bl.run("bit-strings", runs=4, out=study, set=SMALL)
    bl.run("bit-strings", runs=4, out=tmp_path / "whole", set=SMALL, workers=1)
    assert read_records(study) == read_records(tmp_path / "whole")


def test_assays_of_a_custom_model_measure_innate_and_learned_fitness(study: Path) -> None:
    load_file(FILE)
    stored = bl.open_study(study)
    all_agents = ("run", "generation", "agent")
    innate = stored.assay("innate", "bit-strings").energy.mean(all_agents)
    assert innate.sel(life="on") > innate.sel(life="off") >= 1
    # An agent that is born with the learned weights does not need to guess.
    assert innate.sel(life="frozen") >= innate.sel(life="on")
    # The drift control applies only to self-taught networks.
    assert innate.sel(life="drift").isnull()
    assert stored.assay("descent", "bit-strings").effective_ancestors.notnull().all()
    with pytest.raises(
        bl.StudyError,
        match="the assay reaction needs the model miniworld, not bit-strings",
    ):
        stored.assay("reaction")
    neutral = stored.assay("neutral", "bit-strings").energy.mean(all_agents).sel(life="on")
    # Selection has built the genes that learning starts from.
    assert neutral.sel(newborns="evolved") > neutral.sel(newborns="neutral control")
    remove_loaded_parts()
    # A stored assay can be read without the part.
    assert bl.open_study(study).assay("innate", "bit-strings").energy.size
    report = bl.open_study(study).report().read_text()
    assert "the average agent gains" in report
    assert "eats" not in report
    assert "Does selection increase innate fitness?" in report
    assert "Compared with the neutral control" in report


def test_part_sources_in_a_study_are_never_executed(study: Path) -> None:
    for path in (study / "parts").iterdir():
        path.write_text("raise SystemExit('executed')")
    bl.open_study(study).report()
    load_file(FILE)
    bl.run("bit-strings", runs=3, out=study, set=SMALL)


def test_a_sweep_over_the_fields_of_a_part_can_be_read_without_the_part(tmp_path: Path) -> None:
    load_file(FILE)
    plan = {
        "experiment": "bit-strings",
        "runs": 1,
        "fields": {"bit_strings.guesses": [5, 50], "evolution.selection": ["rank", "neutral"]},
    }
    plan["set"] = {"population.size": 40, "evolution.generations": 4}
    sweep = bl.sweep(plan, out=tmp_path / "swept")
    remove_loaded_parts()
    data = sweep.data()
    assert data.sizes["bit_strings.guesses"] == 2
    assert data.energy.notnull().all()
    assert "share of agents with fitness above 0" in sweep.report().read_text()


@pytest.mark.nightly
def test_dask_workers_receive_the_part(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    load_file(FILE)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as local:
        executor = f"dask:{local.scheduler_address}"
        on_dask = bl.run("bit-strings", runs=2, out=tmp_path / "dask", set=SMALL, executor=executor)
        on_dask.assay("neutral", executor=executor)
    bl.run("bit-strings", runs=2, out=tmp_path / "threads", set=SMALL).assay("neutral")
    assert read_records(tmp_path / "dask") == read_records(tmp_path / "threads")
