"""Declarations of the fields of tuples."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest

from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.models.miniworld.declarations import (
    ChosenPart,
    Setting,
    describe_fields,
    find_sources,
    read_settings,
)
from tests.worlds import make_small_experiment


@describe_fields
class Example(NamedTuple):
    """An example."""

    noise: Annotated[np.float32, Setting("motor.noise"), "Share of random actions."]
    is_square: Annotated[bool, Setting("contact.shape", equals="square"), "Whether it is square."]
    weights: Annotated[Any, per_agent("weights"), "Weights."]
    body: Annotated[Any, ChosenPart("motor.body"), "The body."]
    worlds: Annotated[int, "Number of worlds."]


def test_settings_are_read_with_the_type_of_their_field() -> None:
    experiment = make_small_experiment("evo", motor={"noise": 0.25}, contact={"shape": "square"})
    numbers = read_settings(Example, experiment)
    assert numbers == {"noise": 0.25, "is_square": True}
    assert [type(number) for number in numbers.values()] == [np.float32, bool]


@pytest.mark.parametrize(
    ("kind", "names"),
    [(Array, {"weights"}), (ChosenPart, {"body"}), (Setting, {"noise", "is_square"})],
)
def test_sources_are_found_by_their_kind(kind: Any, names: set[str]) -> None:
    assert find_sources(Example, kind).keys() == names


def test_the_docstring_has_the_type_and_the_description_of_each_field() -> None:
    _, _, attributes = str(Example.__doc__).partition("Attributes\n----------\n")
    assert attributes.splitlines()[::2] == [
        "noise : float32",
        "is_square : bool",
        "weights : float32 [weights, lane]",
        "body",
        "worlds : int",
    ]
    assert attributes.splitlines()[1] == "    Share of random actions."
