"""A setting without effect is refused if a user gives it, and accepted in a base or stored file."""

from __future__ import annotations

from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab import papers
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers import PaperError
from baldwinlab.studies.creation import create_study
from tests.commands import Command

SHORT_SETTINGS = {"lifetime.steps": 5, "evolution.generations": 2}
WITHOUT_RULE = (
    r'^learning.{}: does nothing with learning.rule = "none"; '
    "leave it out, or change learning.rule$"
)


@pytest.mark.parametrize(("field", "value"), [("rate", 0.05), ("steps", 100)])
def test_settings_of_learning_are_refused_without_a_learning_rule(
    command: Command, tmp_path: Path, field: str, value: float
) -> None:
    refusal = WITHOUT_RULE.format(field)
    with pytest.raises(bl.ExperimentError, match=refusal):
        bl.run("evo/A", set={f"learning.{field}": value}, out=tmp_path / "study")
    changed = bl.load("evo/A").replace(learning={field: value})
    with pytest.raises(bl.ExperimentError, match=refusal):
        bl.run(changed, out=tmp_path / "study")
    with pytest.raises(bl.ExperimentError, match=refusal):
        bl.simulate(changed)
    outcome = command("run", "evo/A", "--set", f"learning.{field}={value}", "--out", "study")
    assert outcome.code == 2
    assert f"learning.{field}: does nothing" in outcome.err
    assert not (tmp_path / "study").exists()


def test_a_setting_with_an_effect_in_a_different_condition_is_accepted(tmp_path: Path) -> None:
    both = ["evo/A", "evo+self-taught/A"]
    study = bl.run(
        both, runs=1, set={**SHORT_SETTINGS, "learning.rate": 0.05}, out=tmp_path / "study"
    )
    assert [study.experiment(name).learning.rate for name in both] == [0.05, 0.05]


def test_an_unused_setting_of_the_base_is_accepted(tmp_path: Path) -> None:
    (tmp_path / "taught.toml").write_text('base = "evo+self-taught/A"\nlearning.rate = 0.05')
    (tmp_path / "plain.toml").write_text('base = "taught.toml"\nlearning.rule = "none"')
    study = bl.run(tmp_path / "plain.toml", runs=1, set=SHORT_SETTINGS, out=tmp_path / "study")
    assert study.experiment("plain").learning.rate == 0.05


def test_an_unused_setting_that_a_file_adds_to_its_base_is_refused(tmp_path: Path) -> None:
    (tmp_path / "plain.toml").write_text('base = "evo/A"\nlearning.rate = 0.05')
    with pytest.raises(bl.ExperimentError, match=WITHOUT_RULE.format("rate")):
        bl.run(tmp_path / "plain.toml", out=tmp_path / "study")


def test_no_preset_is_refused() -> None:
    for paper in papers.built_in().values():
        for name in paper.experiment_names():
            try:
                experiment = paper.experiment(name)
            # Some conditions do not exist on every map.
            except PaperError:
                continue
            require_effect([experiment])


def sweep_plan(fields: dict[str, list[object]], fixed: dict[str, object]) -> dict[str, object]:
    return {"experiment": "evo/A", "runs": 1, "set": {**SHORT_SETTINGS, **fixed}, "fields": fields}


def test_a_sweep_over_a_field_without_effect_is_refused(tmp_path: Path) -> None:
    plan = sweep_plan({"learning.rate": [0.01, 0.05]}, {"learning.steps": 2})
    refusal = (
        r"set.learning.steps: does nothing .*\n"
        r'.*fields.learning.rate: does nothing with learning.rule = "none"'
    )
    with pytest.raises(bl.ExperimentError, match=refusal):
        bl.sweep(plan, out=tmp_path / "sweep")


def test_a_sweep_over_rules_and_rates_includes_the_condition_without_learning(
    tmp_path: Path,
) -> None:
    fields: dict[str, list[object]] = {
        "learning.rule": ["none", "self-taught"],
        "learning.rate": [0.01, 0.05],
    }
    data = bl.sweep(sweep_plan(fields, {}), out=tmp_path / "sweep").data()
    energy = data.energy.sel({"learning.rule": "none"})
    assert (energy.sel({"learning.rate": 0.01}) == energy.sel({"learning.rate": 0.05})).all()


def test_a_stored_experiment_with_an_unused_setting_can_be_read(tmp_path: Path) -> None:
    experiment: Experiment = bl.load("evo/A").replace(
        learning={"rate": 0.05}, **to_tables(SHORT_SETTINGS)
    )
    create_study(tmp_path / "study", [experiment], 0)
    assert bl.open_study(tmp_path / "study").experiment("evo/A").learning.rate == 0.05


def to_tables(fields: dict[str, int]) -> dict[str, dict[str, int]]:
    return {path.split(".")[0]: {path.split(".")[1]: value} for path, value in fields.items()}
