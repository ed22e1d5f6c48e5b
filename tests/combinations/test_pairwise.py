"""Every two parts of two kinds stand together in an experiment: the same bits in any memory, or one known refusal."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import combinations
from typing import Final

import pytest

from tests.combinations.draw import BREEDING, FORAGERS, MODELS, Settings, pairwise
from tests.combinations.run import check, interpret

SHARES: Final = 8  # so that several processes take part


@cache
def rows() -> Sequence[Settings]:
    return pairwise()


@pytest.mark.nightly
@pytest.mark.parametrize(
    "factors", [FORAGERS | BREEDING, MODELS | BREEDING], ids=["foragers", "models"]
)
def test_the_rows_hold_every_pair_of_values(factors: Settings) -> None:
    of_these = [row for row in rows() if row.keys() == factors.keys()]
    for one, other in combinations(factors, 2):
        expected = {(first, second) for first in factors[one] for second in factors[other]}
        assert {(row[one], row[other]) for row in of_these} == expected


@pytest.mark.nightly
@pytest.mark.parametrize("share", range(SHARES))
def test_pairs_of_parts_are_refused_or_give_the_same_bits(
    share: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    interpret(monkeypatch)
    faults = [(fault, row) for row in rows()[share::SHARES] if (fault := check(row))]
    assert faults == []
