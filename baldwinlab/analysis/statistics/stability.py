"""Stability of a verdict: the share of bootstrap samples of runs with the same verdict.

References
----------
B. Efron and R. Tibshirani, Introduction to the Bootstrap (1993), chapter 6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from baldwinlab.analysis.statistics.bootstrap import (
    SEED,
    Indices,
    draw_resamples,
    split_resamples,
)
from baldwinlab.analysis.statistics.rank_tests import (
    has_exact_mann_whitney,
    has_exact_signed_rank,
    mann_whitney_tests,
    signed_rank_tails,
)
from baldwinlab.analysis.statistics.samples import Sample

# A verdict with a smaller share of bootstrap samples is unstable.
MIN_STABILITY = 0.9
RESAMPLES = 500


def verdict_stability(
    values: Sample, verdict: str, decide: Callable[[Sample], Sequence[str]]
) -> float:
    """Compute the share of bootstrap samples of runs with the same verdict.

    `decide` returns the verdict on each sample of values [sample, run].
    """
    batches = draw_resamples(np.random.default_rng(SEED), RESAMPLES, values.size)
    n_equal = sum(list(decide(values[indices])).count(verdict) for indices in batches)
    return n_equal / RESAMPLES


def direction_stability(
    a: Sample, b: Sample, direction: int, level: float, *, is_paired: bool
) -> float:
    """Compute the share of bootstrap samples of runs with the same direction of a rank test.

    The verdict of a bootstrap sample follows `rules.direction`. Its p-value is exact if that of
    the runs is exact. `level` is that of the uncorrected p-value.
    """
    if is_paired:
        differences = a - b
        ignores_ties = has_exact_signed_rank(differences)
        batches = draw_resamples(np.random.default_rng(SEED), RESAMPLES, a.size)
        directions = [
            _find_paired_directions(differences[indices], level, ignores_ties=ignores_ties)
            for indices in batches
        ]
    else:
        ignores_ties = has_exact_mann_whitney(a, b)
        directions = [
            _find_directions(a[indices_a], b[indices_b], level, ignores_ties=ignores_ties)
            for indices_a, indices_b in _draw_two_samples(a.size, b.size)
        ]
    return float(np.mean(np.concatenate(directions) == direction))


def _draw_two_samples(size_a: int, size_b: int) -> Iterator[tuple[Indices, Indices]]:
    """Yield batches of resamples of both samples. Those of `a` are drawn before those of `b`."""
    generator_a, generator_b = np.random.default_rng(SEED), np.random.default_rng(SEED)
    for _ in draw_resamples(generator_b, RESAMPLES, size_a):
        pass
    for n_rows in split_resamples(RESAMPLES, size_a + size_b):
        yield (
            generator_a.integers(0, size_a, (n_rows, size_a)),
            generator_b.integers(0, size_b, (n_rows, size_b)),
        )


def _find_paired_directions(differences: Sample, level: float, *, ignores_ties: bool) -> Sample:
    """Return the direction of the signed-rank test of each sample [sample, pair]."""
    p = 2 * np.minimum(*signed_rank_tails(differences, ignores_ties=ignores_ties))
    # Ties count half.
    a12 = 0.5 + np.sign(differences).mean(axis=1) / 2
    return _find_significant(np.median(differences, axis=1), p, a12, level)


def _find_directions(
    samples_a: Sample, samples_b: Sample, level: float, *, ignores_ties: bool
) -> Sample:
    """Return the direction of the Mann-Whitney test of each pair of samples [sample, run]."""
    effects = np.median(samples_a, axis=1) - np.median(samples_b, axis=1)
    u, p = mann_whitney_tests(samples_a, samples_b, ignores_ties=ignores_ties)
    a12 = u / (samples_a.shape[1] * samples_b.shape[1])
    return _find_significant(effects, p, a12, level)


def _find_significant(effects: Sample, p: Sample, a12: Sample, level: float) -> Sample:
    """Return the sign of each effect, or 0 if it is not significant."""
    is_significant = (p < level) & (np.sign(effects) == np.sign(a12 - 0.5))
    return np.where(is_significant, np.sign(effects), 0)
