"""Agents learn for life unless a number of steps is given."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.presets import load
from baldwinlab.studies.sweeps import read_sweep
from baldwinlab.studies.sweeps.design import expand_sweep


def test_learning_for_life_is_an_unset_field_in_toml() -> None:
    experiment = load("evo+self-taught/A")
    assert experiment.learning.steps is None
    text = to_toml(experiment)
    assert "steps" not in tomllib.loads(text)["learning"]
    assert "# steps is not set: Number of steps after birth in which an agent learns" in text


@pytest.mark.parametrize(
    ("learning_steps", "expected"), [(None, 300), (0, 0), (299, 299), (301, 300)]
)
def test_an_agent_learns_at_most_for_its_lifetime(
    learning_steps: int | None, expected: int
) -> None:
    experiment = Experiment().replace(learning={"steps": learning_steps}, lifetime={"steps": 300})
    assert experiment.learning_steps == expected


def test_a_random_sweep_draws_whole_numbers_of_learning_steps(tmp_path: Path) -> None:
    """The base is not set, so it does not have the type of the field."""
    path = tmp_path / "mine.toml"
    path.write_text(
        'experiment = "evo+self-taught/A"\nruns = 1\ndesign = "random"\nsamples = 4\n'
        "[fields]\nlearning.steps = { low = 10, high = 90 }"
    )
    steps = [point.learning.steps for point in expand_sweep(read_sweep(path), path)]
    assert all(isinstance(value, int) and 10 <= value <= 90 for value in steps)
