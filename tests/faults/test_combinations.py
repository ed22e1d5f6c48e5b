"""Random combinations of parts: the same bits in any memory, or one known refusal."""

from __future__ import annotations

from typing import Final

import pytest

from tests.combinations.draw import random
from tests.combinations.run import check, interpret
from tests.faults.amount import amount

TOGETHER: Final = 10  # in one test


@pytest.mark.parametrize("seed", range(amount(500, 20) // TOGETHER))
def test_random_combinations_are_refused_or_give_the_same_bits(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    interpret(monkeypatch)
    faults = [(fault, row) for row in random(TOGETHER, seed) if (fault := check(row))]
    assert faults == []
