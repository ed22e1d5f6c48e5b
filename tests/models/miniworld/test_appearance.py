"""How a world looks follows from what its parts declare."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, ClassVar

import pytest

from baldwinlab.experiment import registry
from baldwinlab.models.miniworld.appearance import (
    Kind,
    Mark,
    Sector,
    appearance_json,
    describe_appearance,
)
from baldwinlab.papers.presets import load
from baldwinlab.parts.senses import Sense
from baldwinlab.parts.world_features import ItemRegion, WorldFeature


@pytest.fixture
def swamp() -> Iterator[None]:
    """Items of another kind, a wall, and a sense of what cannot be pointed at."""

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


def test_the_built_in_world_looks_as_the_paper_says() -> None:
    found = describe_appearance(load("evo+self-taught/A"))
    assert found.inputs == ("left", "front", "right")
    assert found.sectors == (Sector(315, 345, 40), Sector(345, 15, 40), Sector(15, 45, 40))
    assert found.actions == ("left", "forward", "right")
    assert found.item_kinds == (Kind("food", "green", 50),)
    assert [mark.label for mark in found.marks] == ["food", "start"]
    assert len(found.modules) == 2
    assert describe_appearance(load("evo/A")).modules == ("action module",)


def test_what_parts_of_one_s_own_declare_is_in_the_look(swamp: None) -> None:
    found = describe_appearance(
        load("evo/A").replace(
            world={"features": ["swamp"]}, senses={"kinds": ["food", "damp"], "visual_radius": 20}
        )
    )
    assert found.inputs[3:] == ("damp", "behind")
    assert found.sectors[3:] == (None, Sector(135, 225, 20))
    assert found.item_kinds == (Kind("food", "green", 50), Kind("frog", "vermilion", 3))
    assert Mark("rectangle", 0, 0, 100, 50, "vermilion", "frog") in found.marks
    assert found.marks[-1] == Mark("rectangle", 10, 20, 30, 40, "#778899", "wall", solid=True)


def test_a_module_that_does_not_say_how_to_act_is_named_by_what_it_says() -> None:
    found = describe_appearance(load("evo/A").replace(learning={"rule": "modulated"}))
    assert found.answers == ("gate",)
    assert found.modules[1] == "reinforcement module: gate, does not learn"
    assert describe_appearance(load("evo+self-taught/A")).answers == ()


@pytest.mark.parametrize("network", ["simple-recurrent", "continuous-time"])
def test_units_that_remember_are_paired_with_what_they_remember(network: str) -> None:
    found = describe_appearance(load("evo/A").replace(network={"kind": network, "hidden": [2]}))
    assert found.memory == ((5, 3), (6, 4))
    assert describe_appearance(load("evo/A")).memory == ()


def test_a_look_is_text_for_whoever_draws() -> None:
    experiment = load("evo/A")
    found = json.loads(appearance_json(experiment))
    assert found["sectors"][0] == {
        "from_degrees": 315,
        "to_degrees": 345,
        "radius": 40,
        "color": "lit",
    }
    assert found["item_kinds"] == [{"name": "food", "color": "green", "number": 50}]
    assert found["inputs"] == ["left", "front", "right"]
