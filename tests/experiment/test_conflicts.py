"""Settings of several worlds and lifetimes that other settings exclude are refused."""

from __future__ import annotations

from typing import Any

import pytest

from baldwinlab.experiment import ExperimentError
from baldwinlab.papers.presets import load

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
