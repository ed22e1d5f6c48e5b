"""Kendall's W, compared with the mean Spearman correlation of all pairs of judges."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis.stages.analysis import measure_agreement


def test_w_follows_from_the_mean_spearman_correlation_of_the_judges() -> None:
    values = np.random.default_rng(1).normal(size=(6, 9)) + np.arange(9) / 4
    correlations = [stats.spearmanr(a, b).statistic for a, b in combinations(values, 2)]
    expected = (5 * np.mean(correlations) + 1) / 6
    assert measure_agreement(values).w == pytest.approx(expected)


def test_equal_rank_orders_agree_completely_also_with_ties() -> None:
    row = np.array([3.0, 1.0, 1.0, 8.0])
    agreement = measure_agreement(np.array([row, row * 2, row + 5]))
    assert agreement.w == pytest.approx(1)
    assert agreement.ranks.tolist() == [[2, 3.5, 3.5, 1]] * 3
    # Opposite rank orders do not agree.
    assert measure_agreement(np.array([[1.0, 2, 3], [3.0, 2, 1]])).w == pytest.approx(0)
    # One judge has no agreement.
    assert np.isnan(measure_agreement(np.array([[1.0, 2, 3]])).w)


def test_the_p_value_is_uniform_if_the_judges_rank_at_random() -> None:
    generator = np.random.default_rng(3)
    ps = [measure_agreement(generator.normal(size=(20, 8))).p for _ in range(400)]
    assert stats.kstest(ps, "uniform").pvalue > 0.01
