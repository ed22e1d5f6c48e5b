"""Test that the appearance of a world follows from the declarations of its parts."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, ClassVar

import pytest

from baldwinlab.experiment import Experiment, registry
from baldwinlab.models.miniworld.appearance import (
    Kind,
    Mark,
    Sector,
    appearance_json,
    describe_appearance,
    list_topics,
)
from baldwinlab.papers.presets import load
from baldwinlab.parts.senses import Sense
from baldwinlab.parts.world_features import ItemRegion, WorldFeature


@pytest.fixture
def swamp() -> Iterator[None]:
    """Register a feature with items and a wall, and a sense with an input without a sector."""

    class Swamp(WorldFeature, name="swamp"):
        def items(self) -> tuple[ItemRegion, ...]:
            return (
                ItemRegion(
                    kind="frog", x=(0, 100), y=(0, 50), count=3, energy=-1, color="vermilion"
                ),
            )

        def map_shapes(self) -> tuple[dict[str, Any], ...]:
            return (
                {
                    "shape": "rectangle",
                    "x": (10, 40),
                    "y": (20, 60),
                    "color": "#778899",
                    "label": "wall",
                },
            )

    class Damp(Sense, name="damp"):
        inputs: ClassVar[tuple[str, ...]] = ("damp", "behind")
        sectors: ClassVar[Any] = (None, (135, 225))

    yield
    registry.remove("world feature", "swamp")
    registry.remove("sense", "damp")


def test_the_built_in_world_has_the_appearance_of_the_paper() -> None:
    appearance = describe_appearance(load("evo+self-taught/A"))
    assert appearance.inputs == ("left", "front", "right")
    assert appearance.sectors == (Sector(315, 345, 40), Sector(345, 15, 40), Sector(15, 45, 40))
    assert appearance.actions == ("left", "forward", "right")
    assert appearance.item_kinds == (Kind("food", "green", 50),)
    assert [mark.label for mark in appearance.marks] == ["food", "start"]
    assert len(appearance.modules) == 2
    assert describe_appearance(load("evo/A")).modules == ("action module",)


def test_declarations_of_custom_parts_are_in_the_appearance(swamp: None) -> None:
    appearance = describe_appearance(
        load("evo/A").replace(
            world={"features": ["swamp"]}, senses={"kinds": ["food", "damp"], "visual_radius": 20}
        )
    )
    assert appearance.inputs[3:] == ("damp", "behind")
    assert appearance.sectors[3:] == (None, Sector(135, 225, 20))
    assert appearance.item_kinds == (Kind("food", "green", 50), Kind("frog", "vermilion", 3))
    assert Mark("rectangle", 0, 0, 100, 50, "vermilion", "frog") in appearance.marks
    assert appearance.marks[-1] == Mark("rectangle", 10, 20, 30, 40, "#778899", "wall", solid=True)


def test_a_module_without_actions_is_named_by_its_outputs() -> None:
    appearance = describe_appearance(load("evo/A").replace(learning={"rule": "modulated"}))
    assert appearance.answers == ("gate",)
    assert appearance.modules[1] == "reinforcement module: gate, does not learn"
    assert describe_appearance(load("evo+self-taught/A")).answers == ()


@pytest.mark.parametrize("network", ["simple-recurrent", "continuous-time"])
def test_memory_units_are_paired_with_their_sources(network: str) -> None:
    appearance = describe_appearance(
        load("evo/A").replace(network={"kind": network, "hidden": [2]})
    )
    assert appearance.memory == ((5, 3), (6, 4))
    assert describe_appearance(load("evo/A")).memory == ()


def test_an_appearance_is_available_as_json() -> None:
    appearance = json.loads(appearance_json(load("evo/A")))
    sector = {"from_degrees": 315, "to_degrees": 345, "radius": 40, "color": "lit"}
    assert appearance["sectors"][0] == sector
    assert appearance["item_kinds"] == [{"name": "food", "color": "green", "number": 50}]
    assert appearance["inputs"] == ["left", "front", "right"]


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


@pytest.mark.parametrize(
    ("name", "changes", "topic", "sentence"),
    [
        ("evo/A", {}, "Network", "The agent performs the action with the largest output."),
        ("evo/A", {"motor": {"body": "continuous"}}, "Network", None),
        ("evo/A", {"senses": {"kinds": ["smell"]}}, "Senses", "more brightly for larger values."),
        ("evo/A", {"evolution": {"inheritance": "social-heredity"}}, "Learning", None),
        (
            "evo+self-taught/A",
            {"evolution": {"inheritance": "social-heredity"}},
            "Learning",
            "The genome at birth is inherited, and the parents teach.",
        ),
    ],
)
def test_sentences_depend_on_the_parts(
    name: str, changes: dict[str, Any], topic: str, sentence: str | None
) -> None:
    text = describe(load(name).replace(**changes))[topic]
    if sentence:
        assert sentence in text
    else:
        assert "largest output" not in text and "parents" not in text
