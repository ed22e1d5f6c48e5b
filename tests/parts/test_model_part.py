"""A model declares the settings with which its agents do not learn, or overrides the methods."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import pytest

from baldwinlab.parts import Model


class Guessers(Model):
    """A model whose agents learn by guesses."""

    guesses: int = 3
    settings_without_learning: ClassVar[Mapping[str, Any]] = {"guesses": 0}


class Stones(Model):
    """A model without learning."""

    name: ClassVar[str] = "stones"


class Apprentices(Model):
    """A model that overrides the methods."""

    trained: bool = True

    @property
    def learns(self) -> bool:
        return self.trained

    def without_learning(self) -> Apprentices:
        return Apprentices(trained=False)


def test_agents_learn_if_a_setting_differs_from_those_without_learning() -> None:
    guessers = Guessers()
    assert guessers.learns
    assert guessers.without_learning() == Guessers(guesses=0)
    assert not guessers.without_learning().learns


def test_a_model_without_learning_settings_has_no_lifetime_without_learning() -> None:
    assert not Stones().learns
    with pytest.raises(ValueError, match="the model 'stones' has no lifetime without learning"):
        Stones().without_learning()


def test_a_model_can_override_the_methods_of_learning() -> None:
    assert Apprentices().learns
    assert not Apprentices().without_learning().learns
