"""Defaults of models: learning, steps of a lifetime and results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pytest

from baldwinlab.parts import Model, Variable


class Guessers(Model):
    """A model whose agents learn by guesses."""

    guesses: int = 3
    lifetime_steps: ClassVar[str] = "guesses"
    settings_without_learning: ClassVar[Mapping[str, Any]] = {"guesses": 0}
    records: ClassVar[Mapping[str, Variable]] = {
        "used": Variable.quantity("guesses", "number of guesses"),
        "succeeded": Variable.flag("1 if a guess succeeded"),
    }


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


def test_results_have_the_declared_types_and_no_cost_by_default() -> None:
    energy = np.array([[1.0, 2.0]])
    guesses = np.array([[3.0, 4.0]])
    results = Guessers().make_results(energy, {"used": guesses, "succeeded": energy > 1})
    assert results.cost.tolist() == [[0, 0]]
    assert results.learned is None
    types = {name: values.dtype for name, values in results.records.items()}
    assert types == {"used": np.float32, "succeeded": np.int32}
    # A record is a copy, so that a later change of the array has no effect.
    guesses[:] = 0
    assert results.records["used"].tolist() == [[3, 4]]


def test_a_lifetime_has_at_least_one_step() -> None:
    assert [Guessers(guesses=guesses).steps for guesses in (3, 0)] == [3, 1]
    assert Stones().steps == 1
