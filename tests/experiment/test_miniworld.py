"""Settings of MiniWorld that exclude each other are refused. Agents learn for life by default."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.presets import load
from baldwinlab.studies.sweeps import read_sweep
from baldwinlab.studies.sweeps.design import expand_sweep

BIRTHS = {"world": {"features": ["births-and-deaths"]}}
SPECIES = {"species": [{"name": "one", "size": 10}, {"name": "two", "size": 10}]}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"population": {"worlds": 3}}, "population.worlds = 3: must divide population.size = 20"),
        (
            BIRTHS | {"population": {"worlds": 2}},
            "population.worlds = 2 must be 1, because world.features has births during life",
        ),
        (
            BIRTHS | {"lifetime": {"repeats": 2}},
            "lifetime.repeats = 2 must be 1, because world.features has births during life",
        ),
        (
            {"lifetime": {"repeats": 2}, "evolution": {"lamarckian_share": 0.5}},
            "lifetime.repeats = 2 must be 1, because evolution.inheritance = 'darwinian' uses the "
            "learned weights",
        ),
        (
            {"lifetime": {"repeats": 2}, "evolution": {"inheritance": "social-heredity"}},
            "lifetime.repeats = 2 must be 1, because evolution.inheritance = 'social-heredity'",
        ),
        (
            {"population": SPECIES | {"worlds": 2}},
            "population.worlds = 2 must be 1, because species share a world",
        ),
        (
            {"population": SPECIES, "record": {"every": 100}},
            "record.every = 100 must be left out",
        ),
    ],
)
def test_excluded_settings_are_refused_in_one_sentence(
    changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(ExperimentError) as error:
        load("evo+self-taught/A").replace(**changes)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


def test_a_schedule_cannot_start_an_inheritance_of_learned_weights_with_several_lifetimes() -> None:
    change = {"generation": 2, "evolution.lamarckian_share": 1.0}
    with pytest.raises(ExperimentError, match=r"generation 2.*lifetime.repeats = 2 must be 1"):
        load("evo+self-taught/A").replace(lifetime={"repeats": 2}, schedule=[change])


@pytest.mark.parametrize(
    ("table", "setting"), [("population", "worlds"), ("record", "every"), ("lifetime", "repeats")]
)
def test_a_model_without_worlds_has_no_such_setting(table: str, setting: str) -> None:
    with pytest.raises(ExperimentError, match=setting if table != "lifetime" else table):
        load("hinton-nowlan").replace(**{table: {setting: 2}})


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
