"""An experiment is immutable and valid. Errors name the path, the value and the allowed values."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from pydantic import ValidationError

from baldwinlab.experiment import Experiment, ExperimentError, assign, validate
from baldwinlab.papers.presets import load

AT_LEAST_1, AT_LEAST_0 = "greater than or equal to 1", "greater than or equal to 0"
MAGIC = {"learning": {"rule": "magic"}}


def region(**changes: Any) -> dict[str, Any]:
    return {"world": {"food": [{"x": [1, 2], "y": [1, 2]} | changes]}}


@pytest.mark.parametrize(
    ("tree", "path", "value", "allowed"),
    [
        ({"population": {"size": 0}}, "population.size", "0", AT_LEAST_1),
        ({"population": {"size": 2.5}}, "population.size", "2.5", "integer"),
        ({"population": {"size": True}}, "population.size", "true", "not numbers"),
        ({"network": {"hidden": [10, 0]}}, "network.hidden.1", "0", AT_LEAST_1),
        ({"network": {"hidden": [1] * 9}}, "network.hidden", "9", "at most 8"),
        ({"network": {"biases": "perhaps"}}, "network.biases", "perhaps", "boolean"),
        ({"senses": {"visual_radius": float("nan")}}, "senses.visual_radius", "nan", "finite"),
        ({"senses": {"visual_radius": 321}}, "senses.visual_radius", "321", "at most 320, half of"),
        ({"senses": {"boundaries": "ajar"}}, "senses.boundaries", "ajar", "'closed' or 'open'"),
        ({"contact": {"shape": "star"}}, "contact.shape", "star", "'circle' or 'square'"),
        ({"contact": {"reach": -1}}, "contact.reach", "-1", "greater than 0"),
        ({"learning": {"rate": -0.1}}, "learning.rate", "-0.1", AT_LEAST_0),
        (MAGIC, "learning.rule", "magic", "'none', 'self-taught', 'abcd',"),
        ({"evolution": {"generations": 0}}, "evolution.generations", "0", AT_LEAST_1),
        ({"evolution": {"mutation_rate": 2}}, "evolution.mutation_rate", "2", "or equal to 1"),
        ({"lifetime": {"steps": 0}}, "lifetime.steps", "0", AT_LEAST_1),
        ({"world": {"width": 5}}, "world.width", "5", "greater than or equal to 10"),
        (region(x=[5, 1]), "world.food.0.x", "[5, 1]", "from a smaller to a larger"),
        (region(count=-1), "world.food.0.count", "-1", AT_LEAST_0),
        ({"name": "../up"}, "name", "../up", "letters, digits"),
    ],
)
def test_an_invalid_field_is_refused_with_its_path_value_and_allowed_values(
    tree: dict[str, Any], path: str, value: str, allowed: str
) -> None:
    with pytest.raises(ExperimentError) as refusal:
        validate(tree)
    message = str(refusal.value)
    assert "\n" not in message
    assert path in message
    assert value in message
    assert allowed in message


def test_an_error_about_a_small_map_names_every_field_outside_of_it() -> None:
    with pytest.raises(ExperimentError) as refusal:
        load("evo/A").replace(world={"width": 320, "height": 100})
    assert str(refusal.value).splitlines() == [
        "world.food.0.x = [400, 560]: must be on the map, from 0 to world.width = 320",
        "world.start.y = 160: must be less than world.height = 100",
        "world.food.0.y = [80, 240]: must be on the map, from 0 to world.height = 100",
    ]


def test_an_unknown_field_is_refused_with_the_existing_names() -> None:
    with pytest.raises(
        ExperimentError, match=r"learning\.rat: there is no such field; there are: rule, rate"
    ):
        validate({"learning": {"rat": 0.1}})
    with pytest.raises(
        ExperimentError, match=r"^speed: there is no such field; there are: name, model, world"
    ):
        validate({"speed": 3})


def test_an_error_lists_all_invalid_fields() -> None:
    with pytest.raises(ExperimentError) as refusal:
        validate({"learning": {"rate": -1}, "lifetime": {"steps": 0}, "foo": 1})
    assert len(str(refusal.value).splitlines()) == 3


def test_an_experiment_is_immutable_and_replace_returns_a_changed_copy() -> None:
    experiment = load("evo/A")
    with pytest.raises((ValidationError, dataclasses.FrozenInstanceError)):
        experiment.name = "other"  # type: ignore[misc]
    changed = experiment.replace(lifetime={"steps": 7})
    assert (changed.lifetime.steps, experiment.lifetime.steps) == (7, 5000)
    assert changed.world == experiment.world
    with pytest.raises(ExperimentError, match=r"lifetime\.steps = 0"):
        experiment.replace(lifetime={"steps": 0})


def test_replace_accepts_a_complete_part() -> None:
    experiment = load("evo/A")
    network = experiment.network.model_copy(update={"hidden": (4,)})
    assert experiment.replace(network=network).network.hidden == (4,)


@pytest.mark.parametrize(
    ("hidden", "biases", "weights"),
    [
        ((), False, 9),
        ((), True, 12),
        ((10,), False, 60),
        ((10,), True, 73),
        ((4, 5), False, 47),
        ((4, 5), True, 59),
    ],
)
def test_the_number_of_weights_follows_from_the_topology(
    hidden: tuple[int, ...], biases: bool, weights: int
) -> None:
    experiment = Experiment().replace(network={"hidden": list(hidden), "biases": biases})
    assert experiment.weight_count == weights


def test_assignments_change_fields_by_their_path() -> None:
    experiment = assign(
        load("evo/A"),
        [
            "lifetime.steps=12",
            "world.food.0.count = 3",
            "evolution.selection=rank",
            "network.hidden=[4, 4]",
            "network.biases=true",
        ],
    )
    assert experiment.lifetime.steps == 12
    assert experiment.world.food[0].count == 3
    assert experiment.evolution.selection == "rank"
    assert experiment.network.hidden == (4, 4)
    assert experiment.network.biases


@pytest.mark.parametrize(
    ("assignment", "message"),
    [
        ("lifetime.steps", "must be path=value"),
        (
            "lifetime.step=3",
            "lifetime.step: there is no 'step' here; there are: steps, repeats, update",
        ),
        ("world.food.4.count=3", "there is no '4' here; there are: 0"),
        ("lifetime.steps.more=3", "there is no 'more' here; there are: none"),
        ("lifetime.steps=many", "lifetime.steps = 'many'"),
    ],
)
def test_an_assignment_to_an_unknown_field_is_refused(assignment: str, message: str) -> None:
    with pytest.raises(ExperimentError) as refusal:
        assign(load("evo/A"), [assignment])
    assert message in str(refusal.value)


def test_equal_experiments_have_equal_hashes_and_a_changed_copy_has_its_hash() -> None:
    experiment = load("evo/A")
    assert hash(experiment) == hash(load("evo/A"))
    larger = experiment.replace(population={"size": 30})
    copied = experiment.model_copy(update={"population": larger.population})
    assert copied == larger
    assert hash(copied) == hash(larger) != hash(experiment)
