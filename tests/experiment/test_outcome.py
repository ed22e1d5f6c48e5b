"""Names of the outcome of presets: one name per quantity."""

from __future__ import annotations

import pytest

from baldwinlab.core.variables import RECORD_VARIABLES, record_variables
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.outcome import (
    combine_outcomes,
    describe_experiment_measures,
    name_food_outcome,
    name_outcome,
    name_outcome_of,
)
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate
from tests.small_studies import shorten_preset

FOOD = RECORD_VARIABLES["energy"].meaning


def name(experiment: BaseExperiment) -> str:
    return name_outcome(record_variables(experiment)["energy"].meaning, [experiment])


@pytest.mark.parametrize(
    ("preset", "outcome"),
    [
        ("evo/A", "items eaten"),
        ("evo+costly-learning/A", "energy"),
        ("predators-learn", "energy"),
        ("guessing", "fitness"),
        ("poles", "steps balanced"),
    ],
)
def test_the_outcome_of_a_preset_has_its_own_name(preset: str, outcome: str) -> None:
    assert name(load(preset)) == outcome


def test_items_eaten_is_the_number_of_items() -> None:
    run = simulate(shorten_preset(), seed=1)
    assert (run["energy"] == run["food_eaten"]).all()
    assert name(shorten_preset()) == "items eaten"


def test_an_item_of_another_energy_makes_the_outcome_energy() -> None:
    (region,) = load("evo/A").to_dict()["world"]["food"]
    rich = load("evo/A").replace(world={"food": [region | {"energy": 2}]})
    assert name(rich) == name_food_outcome([rich]) == "energy"


def test_a_fitness_part_makes_the_outcome_fitness() -> None:
    novel = load("evo/A").replace(evolution={"fitness": "novelty"})
    assert name(novel) == name_food_outcome([novel]) == "fitness"


@pytest.mark.parametrize(
    ("outcomes", "combined"),
    [
        ({"steps balanced"}, "steps balanced"),
        ({"items eaten", "energy"}, "energy"),
        ({"items eaten", "steps balanced"}, "fitness"),
    ],
)
def test_the_outcome_of_several_conditions(outcomes: set[str], combined: str) -> None:
    assert combine_outcomes(outcomes) == combined


def test_conditions_with_different_meanings_are_compared_in_fitness() -> None:
    assert name_outcome("", [load("evo/A"), load("poles")]) == "fitness"
    costly = load("evo+costly-learning/A")
    assert name_outcome(FOOD, [load("evo/A"), costly]) == combine_outcomes(
        {"items eaten", "energy"}
    )


def test_measures_name_the_agent_and_the_outcome() -> None:
    assert name_outcome_of("items eaten", "best agent") == "items eaten by the best agent"
    assert name_outcome_of("fitness", "best agent") == "fitness of the best agent"
    food = describe_experiment_measures(load("evo/A"))
    assert food["mean"]["title"] == "Items eaten by the average agent"
    assert food["share"]["title"] == "Share of agents that eat"
    guessing = describe_experiment_measures(load("guessing"))
    assert guessing["share"]["title"] == "Share of agents with fitness above 0"
