"""Bootstrap resamples are drawn in batches: their results do not change, and their memory is small.

`memory.estimate_tables` contains the measured memory.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from baldwinlab.analysis.statistics import bootstrap, compare, compare_paired
from baldwinlab.analysis.statistics.comparisons import direction_stability, verdict_stability
from baldwinlab.analysis.statistics.survival import Survival, compare_survival
from baldwinlab.simulation import memory

Sample = np.ndarray


def compare_as_survival(a: Sample, b: Sample) -> Any:
    shift = 1 - min(a.min(), b.min())
    return compare_survival(Survival(a + shift, a > 1), Survival(b + shift, b > 1))


def compute_stability(a: Sample, b: Sample) -> Any:
    def decide(samples: Sample) -> list[str]:
        return ["above" if mean > 0 else "below" for mean in samples.mean(axis=1)]

    return verdict_stability(a, "above", decide)


COMPARISONS: dict[str, Callable[[Sample, Sample], Any]] = {
    "Mann-Whitney": compare,
    "sign test": compare_paired,
    "log-rank": compare_as_survival,
    "stability of Mann-Whitney": lambda a, b: direction_stability(a, b, 0, 0.05, is_paired=False),
    "stability of the sign test": lambda a, b: direction_stability(a, b, 0, 0.05, is_paired=True),
    "stability of a verdict": compute_stability,
}


def draw_samples(n_runs: int) -> tuple[Sample, Sample]:
    generator = np.random.default_rng(1)
    return generator.normal(size=n_runs), generator.normal(0.1, size=n_runs)


@pytest.mark.parametrize("name", COMPARISONS)
@pytest.mark.parametrize("n_runs", [6, 61])
def test_batches_of_resamples_give_the_same_numbers_as_one_batch(
    monkeypatch: pytest.MonkeyPatch, name: str, n_runs: int
) -> None:
    results = []
    for n_values in (2**40, 2**13):
        monkeypatch.setattr(bootstrap, "MAX_BATCH_VALUES", n_values)
        bootstrap._draw_first_indices.cache_clear()
        results.append(COMPARISONS[name](*draw_samples(n_runs)))
    np.testing.assert_array_equal(results[0], results[1])


def measure_peak(name: str, n_runs: int) -> int:
    """Return the largest number of allocated bytes during a comparison."""
    samples = draw_samples(n_runs)
    bootstrap._draw_first_indices.cache_clear()
    tracemalloc.start()
    try:
        COMPARISONS[name](*samples)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("name", COMPARISONS)
def test_the_memory_of_a_comparison_of_few_runs_is_within_the_estimate(name: str) -> None:
    n_runs = 100
    assert measure_peak(name, n_runs) < 2 * n_runs * memory.RESAMPLED_RUN_BYTES


def test_the_memory_of_a_comparison_does_not_grow_with_the_number_of_runs() -> None:
    # One batch of all resamples of 1500 runs has 240 MB.
    assert measure_peak("Mann-Whitney", 1500) < 50_000_000


@pytest.mark.nightly
@pytest.mark.parametrize("name", COMPARISONS)
@pytest.mark.parametrize("n_runs", [1000, 10_000])
def test_the_memory_of_a_comparison_of_many_runs_is_within_the_estimate(
    name: str, n_runs: int
) -> None:
    assert measure_peak(name, n_runs) < memory.MAX_RESAMPLED_BYTES
