"""A schedule is a part of the experiment, and is refused where a run could not follow it."""

from __future__ import annotations

from typing import Any

import pytest

import baldwinlab as bl
from baldwinlab.experiment import ExperimentError
from baldwinlab.experiment.schedule import parse_changes
from baldwinlab.experiment.toml import from_toml, to_toml

EXPERIMENT = bl.load("evo+self-taught/A")


def test_a_schedule_survives_its_text() -> None:
    experiment = EXPERIMENT.replace(
        schedule=[
            {"generation": 50, "learning.rule": "none", "motor.noise": 0.25},
            {"generation": 70, "evolution.selection": "tournament"},
        ]
    )
    assert from_toml(to_toml(experiment), "text") == experiment


def test_words_of_a_command_become_a_schedule() -> None:
    words = ["50", "learning.rule=none", "motor.noise=0.5", "70", "learning.rate=1"]
    assert parse_changes(words) == [
        {"generation": 50, "learning.rule": "none", "motor.noise": 0.5},
        {"generation": 70, "learning.rate": 1},
    ]


@pytest.mark.parametrize(
    "words", [["learning.rule=none"], ["50"], ["50", "x=1", "60"], ["-5", "x=1"]]
)
def test_other_words_are_refused(words: list[str]) -> None:
    with pytest.raises(ExperimentError, match="schedule: "):
        parse_changes(words)


def test_a_schedule_that_is_not_a_list_is_refused_as_such() -> None:
    with pytest.raises(ExperimentError, match=r"schedule = '\[\{': input should be a list"):
        EXPERIMENT.replace(schedule="[{")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"population.size": 3}, "population.size cannot change during a run"),
        ({"evolution.generations": 3}, "evolution.generations cannot change during a run"),
        ({"lifetime.steps": 3}, "lifetime.steps cannot change during a run"),
        ({"record.genome_every": 3}, "record.genome_every cannot change during a run"),
        ({"network.hidden": [3]}, "network.hidden cannot change during a run"),
        ({"schedule": []}, "schedule cannot change during a run"),
        ({}, "changes no setting"),
        ({"learning.rule": "nothing"}, "generation 5: learning.rule = 'nothing'"),
        ({"learning.rate": -1}, "generation 5: learning.rate = -1"),
        ({"lerning.rate": 1}, "generation 5: lerning"),
        ({"senses.kinds": ["food", "walls"]}, "generation 5: "),
        ({"world.features": ["births-and-deaths"]}, "generation 5: "),
    ],
)
def test_a_change_that_a_run_cannot_follow_is_refused(
    change: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ExperimentError, match=sentence):
        EXPERIMENT.replace(schedule=[{"generation": 5, **change}])


def test_a_change_cannot_add_a_module_to_the_genome() -> None:
    with pytest.raises(
        ExperimentError, match="the genomes would have the modules action, reinforcement"
    ):
        bl.load("evo/A").replace(schedule=[{"generation": 5, "learning.rule": "self-taught"}])


def test_generations_must_ascend() -> None:
    changes = [{"generation": 5, "learning.rate": 1}, {"generation": 3, "learning.rate": 2}]
    with pytest.raises(
        ExperimentError, match=r"the generations \[5, 3\] must be in ascending order"
    ):
        EXPERIMENT.replace(schedule=changes)


def test_a_setting_for_the_whole_run_removes_its_scheduled_changes() -> None:
    experiment = EXPERIMENT.replace(
        schedule=[
            {"generation": 5, "learning.rule": "hebb"},
            {"generation": 9, "evolution.selection": "tournament"},
        ]
    )
    assert len(experiment.without_learning().schedule) == 1
    assert len(experiment.neutral_control().schedule) == 1
    assert not experiment.without_learning().neutral_control().schedule
    assert len(experiment.replace(evolution={"generations": 7}).schedule) == 2


def test_a_new_name_keeps_the_schedule() -> None:
    experiment = EXPERIMENT.replace(schedule=[{"generation": 5, "learning.rate": 0.5}])
    assert experiment.replace(name="other").schedule == experiment.schedule


def test_a_text_that_chooses_no_part_keeps_the_scheduled_settings_of_parts() -> None:
    experiment = bl.load("evo+imitation/A").replace(
        schedule=[{"generation": 5, "learning.imitation.min_items": 3}]
    )
    changed = experiment.replace(learning={"teacher": "fresh"})
    assert changed.schedule == experiment.schedule
    # Another rule has no such setting.
    assert not experiment.replace(learning={"rule": "hebb"}).schedule
