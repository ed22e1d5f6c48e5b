"""Tests of q-values against the example of the paper, a naive computation and simulation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as some

from baldwinlab.analysis.statistics.significance import critical_p_values, q_values

# The 15 p-values of the example in Benjamini and Hochberg (1995), section 4.
PUBLISHED = [
    0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344,
    0.0459, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0,
]  # fmt: skip


def test_q_values_are_those_of_the_definition() -> None:
    assert int(np.sum(q_values(PUBLISHED) < 0.05)) == 4
    # Q values are those of the definition.
    p = np.array(PUBLISHED)
    n = p.size
    expected = [min(min(1, p[k] * n / (k + 1)) for k in range(i, n)) for i in range(n)]
    assert q_values(PUBLISHED) == pytest.approx(expected)
    # An empty table has no q values.
    assert q_values([]).size == 0 and critical_p_values([]).size == 0


# The third p-value equals the limit of the third rank, which 0.05 * 3 / 3 exceeds by rounding.
@example([0.002, 0.002, 0.05])
@example([0.002] * 7)
@given(some.lists(some.integers(1, 100).map(lambda number: number / 500), min_size=1, max_size=9))
def test_a_test_is_significant_exactly_below_its_critical_p_value(ps: list[float]) -> None:
    criticals = critical_p_values(ps)
    for index, critical in enumerate(criticals):
        for p in (critical * 0.999, np.nextafter(critical, 0), critical, critical * 1.001):
            changed = [*ps[:index], p, *ps[index + 1 :]]
            assert (q_values(changed)[index] < 0.05) == (p < critical)
