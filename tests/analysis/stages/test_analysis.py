"""Learning rules compared with controls, rank agreement, and the specification curve."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis.stages.analysis import (
    NoiseComparison,
    compare_with_noise,
    evaluate_specifications,
    measure_agreement,
)
from baldwinlab.analysis.statistics.bootstrap import Sample
from baldwinlab.experiment.conditions import Factors

NOISE = ("noise", "random")
GENERATOR = np.random.default_rng(4)
MEANS = {
    "s1": {"hebb": (9, 3), "crbp": (1, 1), "noise": (2, 4)},
    "s2": {"hebb": (4, 4), "crbp": (8, 8), "noise": (0, 1)},
    "s3": {"hebb": (7, 7), "crbp": (2, 0), "noise": (6, 6)},
}
SPECIFICATION_FACTORS = {
    f"{variant}/{learner}/{name}": Factors(learner, name, variant)
    for variant, learners in MEANS.items()
    for learner in learners
    for name in "AB"
}
SPECIFICATION_VALUES = {
    name: np.array([MEANS[factor.variant][factor.learner]["AB".index(factor.map)]], float)
    for name, factor in SPECIFICATION_FACTORS.items()
}


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


def test_learners_are_ranked_by_their_mean_over_maps() -> None:
    results = evaluate_specifications(SPECIFICATION_VALUES, SPECIFICATION_FACTORS, ["noise"])
    assert results is not None
    ranks = {row.learner: row.ranks.tolist() for row in results.learners}
    assert ranks == {"hebb": [1, 2, 1], "noise": [2, 3, 2], "crbp": [3, 1, 3]}
    assert [row.learner for row in results.learners] == ["hebb", "noise", "crbp"]
    # The effect is the difference to the best noise control.
    assert results is not None
    (crbp,) = [row for row in results.learners if row.learner == "crbp"]
    assert crbp.effects.tolist() == [-2, 7.5, -5]
    assert crbp.share_above_noise == pytest.approx(1 / 3)


def test_ranks_by_setting_are_medians_over_the_specifications_with_the_value() -> None:
    results = evaluate_specifications(SPECIFICATION_VALUES, SPECIFICATION_FACTORS, ["noise"])
    assert results is not None
    settings = {
        "s1": {"rate": "0.1", "radius": "4"},
        "s2": {"rate": "0.1", "radius": "40"},
        "s3": {"rate": "0.3", "radius": "40"},
    }
    groups = results.rank_by_setting(settings)
    # The ranks of each specification are those of the previous test.
    assert [(group.field, group.value, group.n_specifications) for group in groups] == [
        *(("rate", "0.1", 2), ("rate", "0.3", 1), ("radius", "4", 1), ("radius", "40", 2)),
    ]
    assert groups[0].ranks == {"hebb": 1.5, "crbp": 2, "noise": 2.5}
    assert [group.best for group in groups] == ["hebb"] * 4
    assert groups[3].ranks == {"hebb": 1.5, "crbp": 2, "noise": 2.5}


def test_incomplete_specifications_are_left_out() -> None:
    without = {name: value for name, value in SPECIFICATION_VALUES.items() if name != "s2/crbp/B"}
    results = evaluate_specifications(without, SPECIFICATION_FACTORS, ["noise"])
    assert results is not None and results.specifications == ["s1", "s3"]
    assert evaluate_specifications({}, SPECIFICATION_FACTORS, ["noise"]) is None


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
