"""Tests of the stability of verdicts against the exact probability of a bootstrap sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis.statistics.samples import Sample
from baldwinlab.analysis.statistics.stability import verdict_stability


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


def test_stability_is_reproducible() -> None:
    values = np.random.default_rng(0).normal(size=20)
    first, second = (verdict_stability(values, "yes", is_majority_positive) for _ in range(2))
    assert first == second
