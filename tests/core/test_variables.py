"""The recorded variables have the meaning that the experiment gives them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from baldwinlab.core.variables import Variable, record_variables
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


def test_a_variable_of_agents_has_the_dimensions_and_the_type_of_its_kind() -> None:
    dims = ("generation", "agent")
    assert Variable.share("share of ?") == Variable(dims, np.float32, "1", "share of ?")
    assert Variable.flag("1 if right") == Variable(dims, np.int32, "1", "1 if right")
    assert Variable.integer("loci", "number") == Variable(dims, np.int32, "loci", "number")
    assert Variable.quantity("x", "x at birth") == Variable(dims, np.float32, "x", "x at birth")
