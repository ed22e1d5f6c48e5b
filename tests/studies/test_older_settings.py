"""A study of version 0.1 with old names of settings and parts opens with the current names."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

import baldwinlab as bl
from baldwinlab.experiment import Experiment, ExperimentError, assign, validate
from baldwinlab.experiment.renamed import (
    RENAMED_PARTS,
    RENAMED_SETTINGS,
    RENAMED_TABLES,
    new_path,
    upgrade,
)
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.file import read_stored_sweep, read_sweep
from tests.commands import Command

STORED = Path(__file__).parent / "stored_0_1"
SWEEP = """experiment = "evo/A"
runs = 1
design = "list"
set = { "network.growing.steepness" = 3.0 }
[fields]
"world.births_and_deaths.oldest" = [10, 20]
"network.kind" = ["growing", "feed-forward"]
"""


def condition_with(changes: dict[str, Any], steps: int) -> Experiment:
    """Return a condition of the stored study, with the current names."""
    population = {"population": {"size": 6}, "lifetime": {"steps": steps}}
    return bl.load("evo/A").replace(**population, **changes)


CURRENT_EXPERIMENTS = {
    "births": condition_with(
        {
            "name": "births",
            "evolution": {"generations": 3, "selection": "neutral"},
            "world": {
                "features": ["births-and-deaths"],
                "births_and_deaths": {
                    "initial_energy": 0.5,
                    "cost_per_step": 0.002,
                    "max_age": 300,
                },
            },
        },
        steps=400,
    ),
    "graphs": condition_with(
        {
            "name": "graphs",
            "evolution": {
                "generations": 3,
                "variation": "neat",
                "selection": "species",
                "species": {"champion_species_size": 3},
                "neat": {"add_node_rate": 0.2},
            },
            "network": {"kind": "neat", "hidden": [20], "neat": {"sigmoid_slope": 4.0}},
        },
        steps=40,
    ),
}


@pytest.mark.parametrize("condition", CURRENT_EXPERIMENTS)
def test_a_stored_experiment_is_read_with_current_names(condition: str) -> None:
    assert "reserve" in (STORED / "runs/births/experiment.toml").read_text("utf-8")
    assert (
        StudyStore(STORED).experiment(condition).to_dict()
        == CURRENT_EXPERIMENTS[condition].to_dict()
    )


def test_a_stored_study_can_be_read_reported_and_resumed(tmp_path: Path, command: Command) -> None:
    study = tmp_path / "stored"
    shutil.copytree(STORED, study)
    runs = bl.open_runs(study)
    assert list(runs.condition.values) == ["births", "graphs"]
    assert int(runs.food_eaten.sel(condition="births").sum()) > 0
    resumed = bl.run([*CURRENT_EXPERIMENTS.values()], runs=1, seed=4, out=study)
    assert resumed.directory == study
    assert command("report", str(study)).code == 0


def test_a_stored_sweep_is_read_with_current_names(tmp_path: Path) -> None:
    path = tmp_path / "sweep.toml"
    path.write_text(SWEEP, "utf-8")
    assert "world.births_and_deaths.oldest" in read_sweep(path).fields
    sweep = read_stored_sweep(path)
    assert sweep.fields["world.births_and_deaths.max_age"] == [10, 20]
    assert sweep.fields["network.kind"] == ["neat", "feed-forward"]
    assert sweep.fixed == {"network.neat.sigmoid_slope": 3.0}


RENAMED = [
    (table, old, new) for table, names in RENAMED_SETTINGS.items() for old, new in names.items()
]


@pytest.mark.parametrize(("table", "old", "new"), RENAMED)
def test_an_old_setting_has_exactly_one_new_name(table: str, old: str, new: str) -> None:
    assert new_path(f"{table}.{old}") == f"{table}.{new}"
    assert new_path(f"{table}.{new}") is None
    tree: dict[str, Any] = {old: 1}
    for step in reversed(table.split(".")):
        tree = {step: tree}
    upgraded: Any = upgrade(tree)
    for step in table.split("."):
        upgraded = upgraded[step]
    assert upgraded == {new: 1}


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        (
            ["world.features=['births-and-deaths']", "world.births_and_deaths.reserve=2"],
            "world.births_and_deaths.reserve was renamed to world.births_and_deaths.initial_energy",
        ),
        (["network.kind=growing"], "the network 'growing' was renamed to 'neat'"),
    ],
)
def test_an_assignment_with_an_old_name_is_refused(settings: list[str], sentence: str) -> None:
    with pytest.raises(ExperimentError, match=f"{sentence}: use the new name$"):
        assign(bl.load("evo/A"), settings)


@pytest.mark.parametrize("table", RENAMED_TABLES)
def test_a_file_with_an_old_table_is_refused(table: str) -> None:
    section, _, name = table.partition(".")
    kind = next(names[name] for names in RENAMED_PARTS.values() if name in names)
    with pytest.raises(
        ExperimentError, match=f"^{table} was renamed to {RENAMED_TABLES[table]}: use"
    ):
        validate({section: {"kind": kind, name: {"steepness": 2.0}}})
