"""Small worlds of a check: every pair of agents, update, modules and items of a feature."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations, product

import pytest

from baldwinlab.api.checks.fixture import CASE_SETTINGS, Case, group_parts, make_cases
from baldwinlab.experiment import registry

FACTORS = ({1, 2, 17, 20}, {"sequential", "simultaneous"}, {False, True}, {False, True})


def test_every_pair_of_values_of_two_settings_occurs() -> None:
    for first, second in combinations(range(4), 2):
        pairs = {(values[first], values[second]) for values in CASE_SETTINGS}
        assert pairs == set(product(FACTORS[first], FACTORS[second]))


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("variation", "crossover"),
        ("selection", "rank"),
        ("sense", "food"),
        ("network", "simple-recurrent"),
        ("fitness", "energy"),
    ],
)
def test_the_worlds_of_a_part_differ_in_modules_and_items(kind: str, name: str) -> None:
    (group,) = group_parts([registry.find_class(kind, name)])
    worlds = list(make_cases(group))
    assert len(worlds) == len(CASE_SETTINGS)
    assert {len(case.experiment.modules) for case in worlds} == {1, 2}
    assert {"patches" in case.experiment.world.features for case in worlds} == {False, True}
    assert updates(case for case in worlds if case.is_same_code) == {"sequential", "simultaneous"}


def test_the_worlds_of_a_learning_rule_do_not_change_the_rule() -> None:
    (group,) = group_parts([registry.find_class("learning rule", "self-taught")])
    worlds = list(make_cases(group))
    assert {case.experiment.learning.rule for case in worlds} == {"self-taught"}
    assert {case.experiment.population.size for case in worlds} == FACTORS[0]


def updates(worlds: Iterable[Case]) -> set[str]:
    return {case.experiment.lifetime.update for case in worlds}
