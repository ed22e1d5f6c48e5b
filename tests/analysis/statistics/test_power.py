"""Tests of the required number of runs against simulation."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.analysis.statistics.power import MAX_RUNS, signed_rank_runs
from baldwinlab.analysis.statistics.rank_tests import signed_rank_tails


@pytest.mark.parametrize(("shift", "level"), [(0.5, 0.05), (0.8, 0.05), (0.6, 0.002)])
def test_a_study_of_the_required_size_detects_the_effect_in_four_of_five_cases(
    shift: float, level: float
) -> None:
    generator = np.random.default_rng(5)
    # Enough runs that the observed effect is the true effect.
    runs = signed_rank_runs(generator.normal(shift, 1, 2000), level)
    assert runs is not None
    p_less, p_greater = signed_rank_tails(generator.normal(shift, 1, (2000, runs)))
    power = np.mean(2 * np.minimum(p_less, p_greater) < level)
    assert 0.72 < power < 0.88


@pytest.mark.parametrize("level", [0.05, 0.001])
def test_a_clear_effect_needs_the_runs_with_which_the_test_can_be_significant(
    level: float,
) -> None:
    runs = signed_rank_runs(np.arange(1.0, 9.0), level)
    assert runs is not None
    assert 2.0 ** (1 - runs) < level
    # The normal approximation needs a third more runs at most.
    assert 2.0 ** (1 - runs / 1.5) > level / 2


def test_without_an_effect_no_number_of_runs_decides() -> None:
    assert signed_rank_runs(np.array([-2.0, -1.0, 1.0, 2.0]), 0.05) is None
    nearly = np.random.default_rng(1).normal(0.001, 1, 2000)
    assert (signed_rank_runs(nearly, 0.05) or MAX_RUNS) > 1000
