"""The recorded variables have the meaning that the experiment gives them."""

from __future__ import annotations

from typing import Any

import pytest

from baldwinlab.core.variables import record_variables
from baldwinlab.papers.presets import load

DISTANCE = {"evolution": {"fitness": "distance"}}


@pytest.mark.parametrize(
    ("preset", "changes", "meaning", "unit"),
    [
        (
            "evo/A",
            {},
            "fitness: energy of the items eaten in life minus the cost of learning",
            "energy",
        ),
        ("evo/A", DISTANCE, "fitness 'distance'", "1"),
        (
            "evo/A",
            {"schedule": [{"generation": 5, "evolution.fitness": "distance"}]},
            "fitness 'energy', then 'distance'",
            "1",
        ),
        (
            "evo/A",
            {
                "population": {
                    "size": 4,
                    "species": [
                        {"name": "first", "size": 2, "evolution.fitness": "distance"},
                        {"name": "second", "size": 2},
                    ],
                }
            },
            "fitness",
            "1",
        ),
        ("suzuki-arita-2004:meta-pavlov", {}, "mean payoff per round", "1"),
    ],
    ids=["energy", "distance", "schedule", "species", "model"],
)
def test_the_meaning_of_energy_is_that_of_the_fitness_in_use(
    preset: str, changes: dict[str, Any], meaning: str, unit: str
) -> None:
    experiment = load(preset).replace(**changes)
    variable = record_variables(experiment)["energy"]
    assert (variable.meaning, variable.unit) == (meaning, unit)
