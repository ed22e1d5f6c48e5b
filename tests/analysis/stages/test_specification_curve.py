"""Ranks and effects of learners in all specifications."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.analysis.stages.analysis import evaluate_specifications
from baldwinlab.experiment.factors import Factors

MEANS = {
    "s1": {"hebb": (9, 3), "crbp": (1, 1), "noise": (2, 4)},
    "s2": {"hebb": (4, 4), "crbp": (8, 8), "noise": (0, 1)},
    "s3": {"hebb": (7, 7), "crbp": (2, 0), "noise": (6, 6)},
}
FACTORS = {
    f"{variant}/{learner}/{name}": Factors(learner, name, variant)
    for variant, learners in MEANS.items()
    for learner in learners
    for name in "AB"
}
VALUES = {
    name: np.array([MEANS[factor.variant][factor.learner]["AB".index(factor.map)]], float)
    for name, factor in FACTORS.items()
}


def test_learners_are_ranked_by_their_mean_over_maps() -> None:
    results = evaluate_specifications(VALUES, FACTORS, ["noise"])
    assert results is not None
    ranks = {row.learner: row.ranks.tolist() for row in results.learners}
    assert ranks == {"hebb": [1, 2, 1], "noise": [2, 3, 2], "crbp": [3, 1, 3]}
    assert [row.learner for row in results.learners] == ["hebb", "noise", "crbp"]
    # The effect is the difference to the best noise control.
    assert results is not None
    (crbp,) = [row for row in results.learners if row.learner == "crbp"]
    assert crbp.effects.tolist() == [-2, 7.5, -5]
    assert crbp.share_above_noise == pytest.approx(1 / 3)


def test_incomplete_specifications_are_left_out() -> None:
    without = {name: value for name, value in VALUES.items() if name != "s2/crbp/B"}
    results = evaluate_specifications(without, FACTORS, ["noise"])
    assert results is not None and results.specifications == ["s1", "s3"]
    assert evaluate_specifications({}, FACTORS, ["noise"]) is None
