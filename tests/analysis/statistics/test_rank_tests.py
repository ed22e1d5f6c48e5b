"""Tests of the rank test of equivalence against SciPy, exact ties and simulation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis.statistics.rank_tests import equivalence_p, signed_rank, signed_rank_tails


@pytest.mark.parametrize("runs", [5, 12, 20, 60])
def test_both_one_sided_tests_agree_with_scipy(runs: int) -> None:
    samples = np.random.default_rng(runs).normal(0.1, 1, (3, runs))
    p_less, p_greater = signed_rank_tails(samples)
    for sample, less, greater in zip(samples, p_less, p_greater, strict=True):
        assert less == pytest.approx(stats.wilcoxon(sample, alternative="less").pvalue)
        assert greater == pytest.approx(stats.wilcoxon(sample, alternative="greater").pvalue)


def test_the_smaller_tail_is_half_of_the_two_sided_p_value_with_ties_and_zeros() -> None:
    differences = np.array([0.0, 1.0, 1.0, -1.0, 2.0, 3.0, 3.0, 0.0])
    p_less, p_greater = signed_rank_tails(differences[None])
    assert signed_rank(differences) == pytest.approx(2 * min(p_less[0], p_greater[0]))


def test_the_p_value_is_that_of_the_nearer_bound() -> None:
    differences = np.random.default_rng(1).normal(0.02, 0.06, 15)
    nearer = stats.wilcoxon(differences - 0.05, alternative="less").pvalue
    farther = stats.wilcoxon(differences + 0.05, alternative="greater").pvalue
    assert nearer > farther
    assert equivalence_p(differences[None], 0.05)[0] == pytest.approx(nearer)


def test_exact_ties_in_every_run_have_the_smallest_p_value_with_any_bound() -> None:
    for runs in (1, 2, 8, 30):
        for bound in (0.0, 0.1):
            assert equivalence_p(np.zeros((1, runs)), bound)[0] == 0.5**runs


def test_an_effect_at_the_bound_is_called_equivalent_in_at_most_five_percent_of_studies() -> None:
    samples = np.random.default_rng(2).normal(0.5, 1, (4000, 12))
    share = np.mean(equivalence_p(samples, 0.5) < 0.05)
    # Four standard errors above 5 %.
    assert 0.02 < share < 0.05 + 4 * np.sqrt(0.05 * 0.95 / 4000)


def test_a_small_effect_is_called_equivalent_with_enough_runs() -> None:
    samples = np.random.default_rng(3).normal(0.0, 1, (200, 40))
    assert np.mean(equivalence_p(samples, 1.0) < 0.05) > 0.95
