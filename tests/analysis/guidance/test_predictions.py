"""Predictions on cells with known effects: each can hold, fail, and be undecided."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.atlas.tables import MeanInterval, estimate_mean
from baldwinlab.analysis.guidance.predictions import (
    AGENTS,
    TRIALS,
    K,
    add_effects,
    compute_effects,
    decide_equivalence,
    decide_positive,
    evaluate_predictions,
)
from baldwinlab.papers.guidance_design import read_guidance

DESIGN = read_guidance()
HORIZONS = [0, 20, 100, 500]
NK_ARMS = ["control", "equal-evaluations", "learning", "drift", "yoked", "costly-learning"]
# Effects by arm and K. The ratio of noise to learning falls with K.
EXPECTED: Mapping[str, Mapping[int, float]] = {
    "learning": {0: 0.0, 2: 0.01, 5: 0.03, 10: 0.04},
    "costly-learning": {0: 0.0, 2: 0.01, 5: 0.03, 10: 0.04},
    "equal-evaluations": {0: 0.0, 2: 0.01, 5: 0.01, 10: 0.01},
    "drift": {0: 0.0, 2: 0.009, 5: 0.01, 10: 0.0},
    "yoked": {0: 0.0, 2: 0.009, 5: 0.01, 10: 0.0},
}


def make_cells(
    fields: Mapping[str, list[int]],
    arms: list[str],
    effects: Mapping[str, Mapping[int, float]],
    noise: float = 0.002,
    runs: int = 60,
) -> xr.Dataset:
    """Return cells whose effects by arm and K have a small random error per run."""
    generator = np.random.default_rng(4)
    combinations = [*product(*fields.values())]
    k_values = [dict(zip(fields, values, strict=True)).get(K, 0) for values in combinations]
    shape = (len(combinations), runs, len(arms), 1, len(HORIZONS))
    innate = np.full(shape, 0.8)
    for cell, k in enumerate(k_values):
        for arm, name in enumerate(arms):
            if name != "control":
                errors = generator.normal(0, noise, (runs, 1, 1))
                innate[cell, :, arm] += effects[name][k] + errors
    dims = ("cell", "run", "arm", "start", "horizon")
    coordinates = {
        "cell": [f"cell-{number}" for number in range(len(combinations))],
        "arm": arms,
        "start": ["population"],
        "horizon": HORIZONS,
        **{
            field: ("cell", list(values))
            for field, values in zip(fields, zip(*combinations, strict=True), strict=True)
        },
    }
    return xr.Dataset({"innate": (dims, innate)}, coordinates)


def make_groups(
    effects: Mapping[str, Mapping[int, float]] = EXPECTED,
    *,
    map_a: float = -0.5,
    predicted: float = 0.0,
    noise: float = 0.002,
    runs: int = 60,
) -> dict[str, xr.Dataset]:
    fields = {K: [0, 2, 5, 10], TRIALS: [10, 30], AGENTS: [10, 100]}
    large = {K: [0, 5], TRIALS: [30], AGENTS: [1000]}
    chain = make_cells({K: [0, 5]}, ["control", "learning"], effects, noise, runs)
    expected = [[0.8 + predicted + effects["learning"][k], 0.8] for k in (0, 5)]
    chain["predicted"] = (
        ("cell", "run", "history", "horizon"),
        np.broadcast_to(np.array(expected)[:, None, :, None], (2, runs, 2, len(HORIZONS))),
    )
    chain = chain.assign_coords(history=["learning", "control"])
    cells = {
        "nk": make_cells(fields, NK_ARMS, effects, noise, runs),
        "nk-large": make_cells(large, NK_ARMS, effects, noise, runs),
        "chain": chain,
        "le-a": make_cells({}, ["control", "learning"], {"learning": {0: map_a}}, noise, runs),
    }
    return {name: add_effects(data, is_relative=name == "le-a") for name, data in cells.items()}


def decide(groups: Mapping[str, xr.Dataset]) -> dict[str, str]:
    results = evaluate_predictions(DESIGN.predictions, groups, DESIGN.least_runs)
    return {claim.id: evaluation.verdict for claim, evaluation in results}


def change(arm: str, effects: Mapping[int, float]) -> dict[str, Mapping[int, float]]:
    return {**EXPECTED, arm: effects}


def test_all_predictions_hold_on_the_effects_that_they_predict() -> None:
    assert decide(make_groups()) == dict.fromkeys(["P1", "P2", "P3", "P4", "P5", "P6"], "holds")


WRONG = {
    "P1": make_groups(predicted=0.05),
    "P2": make_groups(change("learning", {**EXPECTED["learning"], 0: 0.05})),
    "P3": make_groups(change("costly-learning", dict.fromkeys([0, 2, 5, 10], 0.0))),
    "P4": make_groups(change("drift", {0: 0.0, 2: 0.0, 5: 0.03, 10: 0.09})),
    "P5": make_groups(change("equal-evaluations", {0: 0.0, 2: 0.01, 5: 0.03, 10: 0.04})),
    "P6": make_groups(map_a=0.1),
}


@pytest.mark.parametrize("prediction", WRONG)
def test_a_prediction_fails_on_the_opposite(prediction: str) -> None:
    assert decide(WRONG[prediction])[prediction] == "does not hold"


def test_predictions_are_undecided_with_noise_and_with_few_runs() -> None:
    undecided = dict.fromkeys(["P1", "P2", "P3", "P4", "P5"], "undecided")
    verdicts = decide(make_groups(noise=0.5))
    assert undecided.items() <= verdicts.items()
    assert {*decide(make_groups(runs=10)).values()} == {"undecided"}


def test_a_ratio_with_an_effect_of_0_is_undecided() -> None:
    groups = make_groups(change("learning", dict.fromkeys([0, 2, 5, 10], 0.0)))
    results = evaluate_predictions(DESIGN.predictions, groups, DESIGN.least_runs)
    (noise,) = [evaluation for claim, evaluation in results if claim.id == "P4"]
    assert noise.verdict == "undecided"
    assert "not above 0 at every K" in noise.numbers


def test_an_effect_of_exactly_0_is_equivalent() -> None:
    assert decide_equivalence(np.zeros(20), 0.01) == "holds"


def test_more_tests_need_a_wider_interval_to_fail() -> None:
    values = np.random.default_rng(1).normal(0.02, 0.02, 20)
    assert estimate_mean(values).low > 0.01
    assert decide_equivalence(values, 0.01) == "does not hold"
    assert decide_equivalence(values, 0.01, n_tests=1000) == "undecided"


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [(0.001, 0.01, "holds"), (-0.01, 0.004, "does not hold"), (-0.01, 0.02, "undecided")],
)
def test_an_effect_is_positive_by_its_interval(low: float, high: float, verdict: str) -> None:
    assert decide_positive(MeanInterval((low + high) / 2, low, high, 20), 0.005) == verdict


def test_relative_effects_are_divided_by_the_higher_mean() -> None:
    innate = np.array([[[4.0], [2.0]], [[2.0], [1.0]]])  # [run, arm, start and horizon].
    cells = xr.Dataset(
        {"innate": (("cell", "run", "arm", "start", "horizon"), innate[None, ..., None])},
        {"arm": ["control", "learning"]},
    )
    absolute = compute_effects(cells, is_relative=False)
    assert absolute.values.ravel().tolist() == [-2, -1]
    relative = compute_effects(cells, is_relative=True)
    assert relative.values.ravel().tolist() == pytest.approx([-2 / 3, -1 / 3])
    assert np.isnan(compute_effects(0 * cells, is_relative=True)).all()
