"""Test that the description of a world follows from its experiment and its parts."""

from __future__ import annotations

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.description import list_topics
from baldwinlab.papers.presets import load


def describe(experiment: Experiment) -> dict[str, str]:
    return {topic.title: topic.text for topic in list_topics(experiment)}


def test_every_topic_describes_the_experiment() -> None:
    texts = describe(
        load("evo+self-taught/A").replace(population={"size": 1000}, senses={"visual_radius": 25})
    )
    assert list(texts) == ["The map", "Senses", "Network", "Learning", "What to look for"]
    assert texts["The map"].startswith(
        "1,000 agents are born in the dashed circle and live 5,000 steps. The tinted"
    )
    assert "50 items of food" in texts["The map"]
    assert "25 map units" in texts["Senses"]
    assert "3 inputs and 3 outputs: left, forward, right." in texts["Network"]
    assert "action module and reinforcement module" in texts["Learning"]
    assert "a condition without learning" in texts["What to look for"]


def test_an_experiment_without_learning_and_without_items_is_described_as_such() -> None:
    texts = describe(load("evo/A").replace(world={"food": []}))
    assert texts["Learning"] == "No learning: the weights do not change during life."
    assert "items" not in texts["The map"]


def test_teaching_by_the_parents_is_described() -> None:
    taught, innate = (
        describe(load(name).replace(evolution={"inheritance": "social-heredity"}))["Learning"]
        for name in ("evo+self-taught/A", "evo/A")
    )
    assert taught.endswith("The genome at birth is inherited, and the parents teach.")
    assert "parents" not in innate, "agents without learning have no teacher"


def test_a_continuous_body_chooses_no_action_and_real_valued_sensors_have_brightness() -> None:
    wheels = describe(
        load("evo/A").replace(motor={"body": "continuous"}, senses={"kinds": ["smell"]})
    )
    assert "largest output" not in wheels["Network"]
    assert wheels["Senses"].endswith(
        "A sector lights up while its sensor is active, more brightly for larger values."
    )
    assert (
        "The agent performs the action with the largest output."
        in describe(load("evo/A"))["Network"]
    )
