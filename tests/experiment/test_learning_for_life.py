"""Agents learn for life unless a number of steps is given.

An earlier version stored learning for life as a large number.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from baldwinlab import sweep
from baldwinlab.experiment import Experiment, assign, validate
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.presets import load
from baldwinlab.studies.sweeps.design import expand_sweep, open_sweep
from baldwinlab.studies.sweeps.file import read_sweep

OLD_NUMBER = 100_000_000


def test_learning_for_life_is_an_unset_field_in_toml() -> None:
    experiment = load("evo+self-taught/A")
    assert experiment.learning.steps is None
    text = to_toml(experiment)
    assert "steps" not in tomllib.loads(text)["learning"]
    assert "# steps is not set: Number of steps after birth in which an agent learns" in text


def test_the_old_number_means_learning_for_life() -> None:
    assert validate({"learning": {"steps": OLD_NUMBER}}) == Experiment()
    stopped = assign(Experiment(), ["learning.steps=10"])
    assert (stopped.learning.steps, stopped.learning_steps) == (10, 10)
    assert assign(stopped, [f"learning.steps={OLD_NUMBER}"]) == Experiment()


@pytest.mark.parametrize(
    ("learning_steps", "expected"), [(None, 300), (0, 0), (299, 299), (301, 300)]
)
def test_an_agent_learns_at_most_for_its_lifetime(
    learning_steps: int | None, expected: int
) -> None:
    experiment = Experiment().replace(learning={"steps": learning_steps}, lifetime={"steps": 300})
    assert experiment.learning_steps == expected


def test_a_sweep_uses_the_old_number_for_learning_for_life(tmp_path: Path) -> None:
    short = "evolution.generations = 1\nlifetime.steps = 10"
    text = (
        f'experiment = "evo+self-taught/A"\nruns = 1\n[set]\n{short}\n'
        f"[fields]\nlearning.steps = [10, {OLD_NUMBER}]"
    )
    path = tmp_path / "mine.toml"
    path.write_text(text)
    plan = read_sweep(path)
    assert [point.learning.steps for point in expand_sweep(plan, path)] == [10, None]
    sweep(path, out=tmp_path / "sweep")
    assert open_sweep(tmp_path / "sweep")["learning.steps"].values.tolist() == [10, OLD_NUMBER]
