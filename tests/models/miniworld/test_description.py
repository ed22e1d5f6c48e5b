"""What one sees of a world is said in the words of its experiment and of its parts."""

from __future__ import annotations

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.description import about
from baldwinlab.papers.presets import load


def words(experiment: Experiment) -> dict[str, str]:
    return {topic.title: topic.text for topic in about(experiment)}


def test_every_topic_says_what_the_experiment_is() -> None:
    found = words(
        load("evo+self-taught/A").replace(population={"size": 1000}, senses={"visual_radius": 25})
    )
    assert list(found) == ["The map", "Senses", "Network", "Learning", "What to look for"]
    assert found["The map"].startswith(
        "1,000 agents are born in the dashed circle and live 5,000 steps. In the tinted"
    )
    assert "50 items of food" in found["The map"]
    assert "25 units far" in found["Senses"]
    assert "from 3 sensors to 3 actions: left, forward, right." in found["Network"]
    assert "the action module; the reinforcement module" in found["Learning"]
    assert "one that does not learn" in found["What to look for"]


def test_what_does_not_learn_says_so_and_where_nothing_lies_nothing_is_promised() -> None:
    found = words(load("evo/A").replace(world={"food": []}))
    assert found["Learning"] == "What happens in life: The weights stay as they were born."
    assert "lie" not in found["The map"]


def test_elders_who_teach_are_told_of() -> None:
    told = words(load("evo+self-taught/A").replace(evolution={"inheritance": "social-heredity"}))[
        "Learning"
    ]
    assert told.endswith("but what teaches a child is what its parents had learned.")
    assert (
        "parents"
        not in words(load("evo/A").replace(evolution={"inheritance": "social-heredity"}))[
            "Learning"
        ]
    ), "no teacher"


def test_who_has_wheels_does_not_choose_and_numbers_are_brighter_the_larger_they_are() -> None:
    wheels = words(load("evo/A").replace(motor={"body": "continuous"}, senses={"kinds": ["smell"]}))
    assert "The largest output" not in wheels["Network"]
    assert wheels["Senses"].endswith(
        "a sector lights up while its sensor fires, the brighter, the more."
    )
    assert "The largest output is what it does." in words(load("evo/A"))["Network"]
