"""Selections: which results of a generation a hook reads."""

from __future__ import annotations

from typing import Any

import pytest

from baldwinlab.experiment import registry
from baldwinlab.parts.selection import Generation, Selection, reads_lifetimes


def fill_parents(generation: Generation) -> None:
    generation.parents[:] = 0


class PassesGeneration(Selection):
    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        fill_parents(generation)


class ReadsFitness(Selection):
    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        generation.parents[:] = generation.fitness.argmax()


@pytest.mark.parametrize(
    ("name", "expected"),
    [("tournament", False), ("lexicase", True), ("fitness-sharing", True), ("species", True)],
)
def test_a_built_in_selection_reads_lifetimes_if_its_source_does(name: str, expected: bool) -> None:
    assert reads_lifetimes(registry.find_class("selection", name)) is expected


def test_a_selection_that_passes_its_generation_to_a_function_could_read_lifetimes() -> None:
    assert reads_lifetimes(PassesGeneration)
    assert not reads_lifetimes(ReadsFitness)


def test_a_selection_without_source_could_read_lifetimes() -> None:
    namespace: dict[str, Any] = {}
    exec("def select(part, generation):\n    generation.parents[:] = 0\n", namespace)
    without_source = type("WithoutSource", (Selection,), {"select": namespace["select"]})
    assert reads_lifetimes(without_source)
