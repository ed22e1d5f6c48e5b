"""Agents learn for life unless a number of steps is given; what was stored when "for life" was a number says the same."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from baldwinlab import sweep
from baldwinlab.experiment import Experiment, assign, validate
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.papers.presets import load
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.sweeps.design import expand_sweep, open_sweep
from baldwinlab.studies.sweeps.file import read
from tests.small_studies import rewrite_in_format_1

OLD = 100_000_000


def as_it_was_written(experiment: Experiment) -> str:
    """The TOML text of an experiment by a version in which learning for life was a number."""
    lines = to_toml(experiment).splitlines()
    return "\n".join(
        f"steps = {OLD}" if line.startswith("# steps is not set") else line for line in lines
    )


def test_learning_for_life_is_not_set_and_so_it_stands_in_toml() -> None:
    experiment = load("evo+self-taught/A")
    assert experiment.learning.steps is None
    text = to_toml(experiment)
    assert "steps" not in tomllib.loads(text)["learning"]
    assert "# steps is not set: Number of steps after which learning stops" in text


def test_the_number_of_before_means_for_life() -> None:
    assert validate({"learning": {"steps": OLD}}) == Experiment()
    stopped = assign(Experiment(), ["learning.steps=10"])
    assert (stopped.learning.steps, stopped.learning_steps) == (10, 10)
    assert assign(stopped, [f"learning.steps={OLD}"]) == Experiment()


@pytest.mark.parametrize(("stops", "steps"), [(None, 300), (0, 0), (299, 299), (301, 300)])
def test_an_agent_learns_at_most_as_long_as_it_lives(stops: int | None, steps: int) -> None:
    assert (
        Experiment().replace(learning={"steps": stops}, lifetime={"steps": 300}).learning_steps
        == steps
    )


def test_a_study_of_before_is_the_same_and_carries_on(tmp_path: Path) -> None:
    experiment = load("evo+self-taught/A")
    study = create_study(tmp_path / "study", [experiment], seed=1)
    stored = (
        rewrite_in_format_1(study.directory, [experiment.name], seed=1)
        / "runs"
        / experiment.name
        / "experiment.toml"
    )
    stored.write_text(as_it_was_written(experiment))
    assert f"steps = {OLD}" in stored.read_text()
    assert (
        create_study(tmp_path / "study", [experiment], seed=1).experiments[experiment.name]
        == experiment
    )
    assert from_toml(stored.read_text(), where="there") == experiment


def test_a_sweep_has_a_number_for_learning_for_life(tmp_path: Path) -> None:
    short = "evolution.generations = 1\nlifetime.steps = 10"
    text = f'experiment = "evo+self-taught/A"\nruns = 1\n[set]\n{short}\n[fields]\nlearning.steps = [10, {OLD}]'
    path = tmp_path / "mine.toml"
    path.write_text(text)
    plan = read(path)
    assert [each.learning.steps for each in expand_sweep(plan, path)] == [10, None]
    sweep(path, out=tmp_path / "sweep")
    assert open_sweep(tmp_path / "sweep")["learning.steps"].values.tolist() == [10, OLD]
