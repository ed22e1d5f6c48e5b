"""Tests of the stability of verdicts against the exact probability of a bootstrap sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis.statistics.bootstrap import Sample
from baldwinlab.analysis.statistics.comparisons import direction_stability, verdict_stability
from baldwinlab.analysis.statistics.significance import PlannedTest, TestMethod


def is_majority_positive(samples: Sample) -> Sequence[str]:
    return ["yes" if positive > 0.5 else "no" for positive in (samples > 0).mean(axis=1)]


def test_stability_is_the_probability_that_a_bootstrap_sample_has_the_same_verdict() -> None:
    values = np.array([1.0] * 9 + [-1.0] * 6)
    expected = stats.binom.sf(7, 15, 9 / 15)
    stability = verdict_stability(values, "yes", is_majority_positive)
    # Four standard errors of 500 samples.
    assert stability == pytest.approx(expected, abs=4 * np.sqrt(expected * (1 - expected) / 500))
    assert stability + verdict_stability(values, "no", is_majority_positive) == pytest.approx(1)


def test_runs_that_agree_have_a_stable_verdict() -> None:
    assert verdict_stability(np.full(8, 2.0), "yes", is_majority_positive) == 1
    # Stability is reproducible.
    values = np.random.default_rng(0).normal(size=20)
    first, second = (verdict_stability(values, "yes", is_majority_positive) for _ in range(2))
    assert first == second
    # Equal values are undecided in every bootstrap sample.
    values = np.full(6, 3.0)
    for is_paired in (False, True):
        assert direction_stability(values, values, 0, 0.05, is_paired=is_paired) == 1


def naive_direction(a: Sample, b: Sample, level: float, is_paired: bool) -> int:
    effect = float(np.median(a - b) if is_paired else np.median(a) - np.median(b))
    if is_paired:
        p = float(stats.wilcoxon(a, b).pvalue)
        a12 = float(np.mean(a > b) + np.mean(a == b) / 2)
    else:
        p = float(stats.mannwhitneyu(a, b, method="exact").pvalue)
        a12 = float(np.mean(a[:, None] > b) + np.mean(a[:, None] == b) / 2)
    if p >= level or np.sign(effect) != np.sign(a12 - 0.5):
        return 0
    return int(np.sign(effect))


@pytest.mark.parametrize("is_paired", [False, True])
def test_the_stability_of_a_direction_is_its_share_of_bootstrap_samples(is_paired: bool) -> None:
    """The oracle draws its own samples and decides each of them alone."""
    generator = np.random.default_rng(7)
    a = generator.normal(0.8, 1, 20)
    b = generator.normal(0, 1, 20)
    counts = {-1: 0, 0: 0, 1: 0}
    for _ in range(500):
        indices = generator.integers(0, 20, 20)
        indices_b = indices if is_paired else generator.integers(0, 20, 20)
        counts[naive_direction(a[indices], b[indices_b], 0.01, is_paired)] += 1
    for direction, count in counts.items():
        share = direction_stability(a, b, direction, 0.01, is_paired=is_paired)
        # Five standard errors of the difference of two shares.
        assert share == pytest.approx(count / 500, abs=5 * np.sqrt(2 * 0.25 / 500))
    assert 0.1 < counts[1] / 500 < 0.9


@pytest.mark.parametrize(
    ("size_a", "size_b", "method"),
    [
        (6, 20, "Mann-Whitney"),
        (8, 8, "Mann-Whitney"),
        (3, 100, "Mann-Whitney"),
        (9, 9, "Wilcoxon"),
        (14, 14, "Wilcoxon"),
    ],
)
def test_a_verdict_at_the_smallest_p_value_is_stable(
    size_a: int, size_b: int, method: TestMethod
) -> None:
    """Samples far apart are separated in every bootstrap sample, so that p is always smallest."""
    level = 1.01 * PlannedTest(size_a, size_b, method).smallest_p
    a = 1000 + np.random.default_rng(1).normal(size=size_a)
    b = np.random.default_rng(2).normal(size=size_b)
    is_paired = method == "Wilcoxon"
    assert direction_stability(a, b, 1, level, is_paired=is_paired) == 1
