"""Test senses and bodies against their oracles in plain Python. A nightly test compiles them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from baldwinlab.api.checks.fixture import group_parts
from baldwinlab.api.checks.oracles import check_oracle
from baldwinlab.experiment import registry
from tests.oracles.parts import use_oracles

PATCHES = {"features": ["patches"], "patches": {"patches": [[300, 480, 60, 260, 25, -1.5]]}}
# Changes of the experiment in which a sense is checked.
SENSES: dict[str, dict[str, Any]] = {
    "compass": {},
    "energy": {"world": PATCHES},
    "food-rays": {"world": PATCHES},
    "last-action": {"motor": {"noise": 0.4}},
    "nearest": {"senses": {"nearest": {"target_kind": "patch"}}, "world": PATCHES},
    "neighbours": {},
    "patch": {"world": PATCHES},
    "rays": {"senses": {"rays": {"target_kind": "patch", "item_radius": 3}}, "world": PATCHES},
    "smell": {"senses": {"smell": {"target_kind": "patch"}}, "world": PATCHES},
}
BODIES: dict[str, dict[str, Any]] = {
    "continuous": {"motor": {"continuous": {"max_turn": 180}}},
    "grid": {},
    "stay": {},
}
CASES = [
    *(("sense", name, {}) for name in SENSES),
    *(("sense", name, changes) for name, changes in SENSES.items() if changes),
    *(("body", name, changes) for name, changes in BODIES.items()),
    ("body", "continuous", {}),
]


@pytest.mark.parametrize(("kind", "name", "changes"), CASES)
def test_a_part_agrees_with_its_oracle(
    kind: str, name: str, changes: dict[str, Any], in_plain_python: None
) -> None:
    (group,) = group_parts([registry.find_class(kind, name)])
    experiment = group.experiment.replace(population={"size": 8}).replace(**changes)
    with use_oracles(), np.errstate(all="ignore"):
        check_oracle(group._replace(experiment=experiment))
