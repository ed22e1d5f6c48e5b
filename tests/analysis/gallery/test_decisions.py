"""Decisions on artificial estimates."""

from __future__ import annotations

from math import isnan
from typing import Any

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis.estimands.questions import IMPOSSIBLE, NOT_MEASURABLE, Estimate
from baldwinlab.analysis.gallery.decisions import (
    COLUMNS,
    Decision,
    Measurement,
    SystemName,
    decide,
    describe_too_few_runs,
)
from tests.analysis.gallery.artificial_estimates import make_estimate

RUNS = 20


def decide_estimates(*estimates: Estimate) -> list[Decision]:
    return decide(
        {SystemName(f"paper-{i}", "learner"): [entry] for i, entry in enumerate(estimates)}
    )


def find_measurement(values: Any, bound: float = 0.1) -> Measurement:
    (decision,) = decide_estimates(make_estimate(values, bound=bound))
    assert decision.measurement is not None
    return decision.measurement


def sign_p(values: np.ndarray) -> float:
    """Return the p-value of the sign test, by SciPy's binomial test."""
    return float(stats.binomtest(int((values > 0).sum()), int((values != 0).sum())).pvalue)


def normal(mean: float, deviation: float = 1.0, runs: int = RUNS) -> np.ndarray:
    # Quantiles instead of random values: the sample has exactly this mean.
    quantiles = (np.arange(runs) + 0.5) / runs
    return mean + deviation * stats.norm.ppf(quantiles)


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        (normal(1.0), "yes"),
        (normal(-1.0), "opposite"),
        (normal(0.0, 0.05), "equivalent"),
        (normal(0.2), "undecided"),
    ],
)
def test_a_measured_question_has_one_of_four_verdicts(values: Any, verdict: str) -> None:
    assert find_measurement(values).verdict == verdict


def test_values_of_0_in_every_run_are_a_class_without_a_test() -> None:
    decisions = decide_estimates(
        make_estimate(np.zeros(RUNS)), make_estimate([0.0, np.nan]), make_estimate(normal(1.0))
    )
    rows = [decision.row() for decision in decisions]
    assert [row["class"] for row in rows] == [
        "equal in every run",
        "equal in every run",
        "measured",
    ]
    assert rows[0]["p"] is rows[0]["verdict"] is None
    assert rows[2]["q"] == rows[2]["p"], "the only test of the table"


def test_a_significant_effect_within_the_bound_is_equivalent() -> None:
    measurement = find_measurement(normal(0.02, 0.01))
    assert measurement.p < 0.001 and measurement.verdict == "equivalent"
    assert find_measurement(normal(0.02, 0.01), bound=0.01).verdict == "yes"


def test_effect_interval_and_stability_are_of_the_median_over_defined_runs() -> None:
    values = np.append(normal(1.0), np.nan)
    measurement = find_measurement(values)
    assert measurement.runs == RUNS and measurement.effect == pytest.approx(1.0)
    assert measurement.low < 1.0 < measurement.high
    assert measurement.p == pytest.approx(sign_p(normal(1.0)))
    # The interval has exactly the medians that the test does not reject.
    for end in (measurement.low, measurement.high):
        p_values = [sign_p(normal(1.0) - end - step) for step in (-1e-9, 1e-9)]
        assert min(p_values) < 0.05 <= max(p_values)
    # A verdict that depends on the sampled runs is unstable.
    assert find_measurement(normal(2.0)).stability == 1
    assert find_measurement(normal(0.5)).is_unstable


def test_q_values_are_corrected_over_the_systems_of_the_table() -> None:
    samples = [normal(mean) for mean in (1.0, 0.6, 0.5, 0.1)]
    measurements = [
        d.measurement for d in decide_estimates(*map(make_estimate, samples)) if d.measurement
    ]
    ps = [sign_p(sample) for sample in samples]
    assert [measurement.q for measurement in measurements] == pytest.approx(
        stats.false_discovery_control(ps)
    )
    assert [measurement.verdict for measurement in measurements] == [
        "yes" if measurement.q < 0.05 else "undecided" for measurement in measurements
    ]


def test_too_few_runs_are_stated_with_the_required_number() -> None:
    decisions = decide_estimates(make_estimate(np.arange(1.0, 6.0)))
    # The smallest p-value of five runs is 2 / 2 ** 5.
    assert "At least 6 runs are needed" in describe_too_few_runs(decisions)
    assert find_measurement(np.arange(1.0, 7.0)).verdict == "yes"
    assert describe_too_few_runs(decide_estimates(make_estimate(np.arange(1.0, 7.0)))) == ""
    # One run has no interval and cannot suffice.
    measurement = find_measurement([3.0])
    assert isnan(measurement.low) and measurement.p == 1 and measurement.label == "too few runs"


def test_a_measured_question_is_decided_by_the_required_runs() -> None:
    measurement = find_measurement(normal(0.3))
    assert measurement.verdict == "undecided" and measurement.required_runs is not None
    generator = np.random.default_rng(3)
    studies = generator.normal(0.3, 1, (300, measurement.required_runs))
    power = np.mean([sign_p(study) < 0.05 for study in studies])
    assert 0.7 < power < 0.95
    # A small effect needs runs for equivalence.
    measurement = find_measurement(normal(0.0, 0.3), bound=0.1)
    assert measurement.verdict == "undecided" and measurement.required_runs is not None
    values = normal(0.0, 0.3, runs=measurement.required_runs)
    assert find_measurement(values).verdict == "equivalent"


def test_classes_without_values_have_no_numbers_and_are_not_tested() -> None:
    decisions = decide_estimates(
        make_estimate(measurability=IMPOSSIBLE),
        make_estimate(measurability=NOT_MEASURABLE),
        make_estimate([np.nan, np.nan]),
        make_estimate(normal(0.48)),
    )
    rows = [decision.row() for decision in decisions]
    classes = ["impossible", "not measurable", "not measurable", "measured"]
    assert [row["class"] for row in rows] == classes
    assert all(tuple(row) == COLUMNS for row in rows)
    assert all(row["verdict"] is row["estimate"] is row["q"] is None for row in rows[:3])
    assert rows[3]["q"] == pytest.approx(rows[3]["p"]), "the only test of the table"
