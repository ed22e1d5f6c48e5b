"""All pairs of parts of two kinds: each experiment is reproducible or has an expected refusal."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import combinations
from typing import Final

import pytest

from tests.combinations.draw import BREEDING, FORAGERS, MODELS, Settings, make_pairwise_rows
from tests.combinations.run import check_row, disable_all_compilation, poison_newborns

# The number of tests, so that several processes can share the work.
SHARES: Final = 8


@cache
def rows() -> Sequence[Settings]:
    return make_pairwise_rows()


@pytest.mark.nightly
@pytest.mark.parametrize(
    "factors", [FORAGERS | BREEDING, MODELS | BREEDING], ids=["foragers", "models"]
)
def test_the_rows_contain_every_pair_of_values(factors: Settings) -> None:
    matching_rows = [row for row in rows() if row.keys() == factors.keys()]
    for factor, second_factor in combinations(factors, 2):
        expected = {
            (first, second) for first in factors[factor] for second in factors[second_factor]
        }
        assert {(row[factor], row[second_factor]) for row in matching_rows} == expected


@pytest.mark.nightly
@pytest.mark.parametrize("share", range(SHARES))
def test_pairs_of_parts_are_refused_or_reproducible(
    share: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    disable_all_compilation(monkeypatch)
    poison_newborns(monkeypatch)
    faults = [(fault, row) for row in rows()[share::SHARES] if (fault := check_row(row))]
    assert faults == []
