"""Comparison of learning rules with noise controls and matched controls."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis.stages.analysis import NoiseComparison, compare_with_noise
from baldwinlab.analysis.statistics.bootstrap import Sample
from baldwinlab.experiment.factors import Factors

NOISE = ("noise", "random")
GENERATOR = np.random.default_rng(4)


def sample(mean: float) -> Sample:
    return mean + GENERATOR.normal(size=12)


VALUES = {
    "evo/A": sample(0),
    "hebb/A": sample(9),
    "hebb+yoked/A": sample(3),
    "hebb+drift/A": sample(12),
    "crbp/A": sample(5.2),
    "noise/A": sample(2),
    "random/A": sample(5),
    "hebb/B": sample(4),
    "noise/B": sample(6),
}
FACTORS = {name: Factors(*name.split("/")) for name in VALUES}


@pytest.fixture
def rows() -> dict[str, NoiseComparison]:
    table = compare_with_noise(VALUES, FACTORS, NOISE, {"hebb/A": "rate 0.1"})
    return {row.condition: row for row in table}


def test_the_noise_control_is_the_best_one_of_the_map(rows: dict[str, NoiseComparison]) -> None:
    noise = rows["hebb/A"].noise
    assert noise and noise.control == "random/A"
    medians = np.median(VALUES["hebb/A"]) - np.median(VALUES["random/A"])
    assert noise.numbers.effect == pytest.approx(medians)
    other_map = rows["hebb/B"].noise
    assert other_map and other_map.control == "noise/B"
    assert rows["noise/A"].noise is None


def test_the_p_value_is_the_largest_of_all_noise_controls(rows: dict[str, NoiseComparison]) -> None:
    crbp = rows["crbp/A"].noise
    ps = [
        stats.mannwhitneyu(VALUES["crbp/A"], VALUES[control], method="exact").pvalue
        for control in ("noise/A", "random/A")
    ]
    assert crbp and crbp.p == pytest.approx(max(ps))
    assert ps[0] < 0.001 < ps[1]
    # The q values are corrected over all rows.
    effects = [row.noise for row in rows.values() if row.noise]
    expected = stats.false_discovery_control([effect.p for effect in effects])
    assert [effect.q for effect in effects] == pytest.approx(expected.tolist())


def test_a_rule_is_compared_with_its_own_matched_controls(rows: dict[str, NoiseComparison]) -> None:
    matched = rows["hebb/A"].matched
    assert matched["yoked"].numbers.effect > 0 > matched["drift"].numbers.effect
    assert rows["crbp/A"].matched == {} and rows["hebb/B"].matched == {}
    # Matched controls have no rows.
    assert list(rows) == ["evo/A", "hebb/A", "crbp/A", "noise/A", "random/A", "hebb/B", "noise/B"]
    assert rows["hebb/A"].setting == "rate 0.1"
    # Undefined numbers are none in the record.
    record = rows["noise/A"].record()
    assert record["noise_effect"] is None and record["yoked_q"] is None
    assert record["runs"] == 12
