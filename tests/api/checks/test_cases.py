"""The small worlds of a check hold every pair of agents, update, modules and items of a feature."""

from __future__ import annotations

from itertools import combinations, product
from typing import Any

import pytest

from baldwinlab.api.checks.cases import SETTINGS, cases
from baldwinlab.api.checks.fixture import subjects
from baldwinlab.experiment import registry

FACTORS = ({1, 2, 17, 20}, {"sequential", "simultaneous"}, {False, True}, {False, True})


def test_every_pair_of_values_of_two_settings_is_among_them() -> None:
    for one, other in combinations(range(4), 2):
        pairs = {(setting[one], setting[other]) for setting in SETTINGS}
        assert pairs == set(product(FACTORS[one], FACTORS[other]))


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
def test_a_part_is_tried_with_genomes_of_one_and_of_two_modules_and_with_items_of_a_feature(
    kind: str, name: str
) -> None:
    (subject,) = subjects([registry.find(kind, name)])
    found = list(cases(subject))
    assert len(found) == len(SETTINGS)
    assert {len(case.experiment.modules) for case in found} == {1, 2}
    assert {"patches" in case.experiment.world.features for case in found} == {False, True}
    assert updates(case for case in found if case.is_same_code) == {"sequential", "simultaneous"}


def test_a_learning_rule_keeps_its_own_modules() -> None:
    (subject,) = subjects([registry.find("learning rule", "self-taught")])
    found = list(cases(subject))
    assert {case.experiment.learning.rule for case in found} == {"self-taught"}
    assert {case.agents for case in found} == FACTORS[0]


def updates(found: Any) -> set[str]:
    return {case.experiment.lifetime.update for case in found}
