"""Random combinations of parts give reproducible results or an expected refusal."""

from __future__ import annotations

from typing import Final

import pytest

from tests.combinations.draw import draw_random
from tests.combinations.run import check_row, disable_all_compilation, poison_newborns
from tests.faults import amount

COMBINATIONS_PER_TEST: Final = 5


@pytest.mark.parametrize("seed", range(amount(500, 5) // COMBINATIONS_PER_TEST))
def test_random_combinations_are_refused_or_reproducible(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    disable_all_compilation(monkeypatch)
    poison_newborns(monkeypatch)
    faults = [
        (fault, row)
        for row in draw_random(COMBINATIONS_PER_TEST, seed)
        if (fault := check_row(row))
    ]
    assert faults == []
