"""Test that a class with a hook or flag of version 0.1 is refused with the new name."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import Field

import baldwinlab.parts
from baldwinlab import parts
from baldwinlab.core.errors import PartError
from baldwinlab.parts.renamed import RENAMED_BY_KIND, RENAMED_CLASSES, RENAMED_IN_ALL_KINDS

KINDS: list[Any] = [
    parts.Sense,
    parts.Body,
    parts.Network,
    parts.LearningRule,
    parts.WorldFeature,
    parts.Selection,
    parts.Variation,
    parts.Inheritance,
    parts.Fitness,
    parts.Model,
]


def old_names() -> Iterator[Any]:
    """Yield each kind of part with an old name and its new name."""
    for kind in KINDS:
        for old, new in {**RENAMED_IN_ALL_KINDS, **RENAMED_BY_KIND[kind.kind]}.items():
            yield pytest.param(kind, old, new, id=f"{kind.__name__}-{old}")


@pytest.mark.parametrize(("kind", "old", "new"), [*old_names()])
def test_an_old_name_is_refused_with_the_new_name(kind: Any, old: str, new: str) -> None:
    sentence = f"^{old} was renamed to {new}: use the new name in the class Custom$"
    for value in (staticmethod(lambda part: None), True):
        with pytest.raises(PartError, match=sentence):
            define_class(kind, {old: value})
    assert hasattr(kind, new)


def define_class(kind: Any, attributes: dict[str, Any]) -> None:
    type(kind)("Custom", (kind,), {**attributes, "__module__": __name__}, name="custom")


def test_all_old_names_of_a_class_are_in_one_sentence() -> None:
    with pytest.raises(PartError, match=r"^hatch was .* init_agent, meet was .* observe_others: "):
        define_class(parts.LearningRule, {"hatch": None, "meet": None})


def test_a_setting_may_have_an_old_name() -> None:
    class Pausing(parts.WorldFeature):
        stops: int = Field(3, ge=0, le=9, description="pauses of an agent")

    assert Pausing().stops == 3


@pytest.mark.parametrize("old", RENAMED_CLASSES)
def test_an_old_class_is_refused_with_the_new_name(old: str) -> None:
    with pytest.raises(ImportError, match=rf"^baldwinlab\.parts\.{old} was renamed to \w+$"):
        getattr(baldwinlab.parts, old)
    assert hasattr(parts, RENAMED_CLASSES[old])
    assert not hasattr(parts, "Unknown")
