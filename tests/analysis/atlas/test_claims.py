"""Claims of the atlas: each holds, fails, and is undecided on data of which this is known."""

import hashlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.atlas.claims import (
    ABOVE_ZERO,
    BELOW_ZERO,
    CORRELATION,
    COSTS,
    CURVATURE,
    EVALUATIONS,
    NK_COST,
    RANK,
    REGIME_SLOPES,
    ROULETTE,
    SELECTION,
    SHARE,
    SPEED,
    STEP,
    TOURNAMENT,
    TRIALS,
    ClaimPart,
    K,
    describe_limits,
    evaluate_claims,
    limit_to_shares,
    refuse_verdicts,
)
from baldwinlab.analysis.atlas.laws import LAWS, predict_threshold
from baldwinlab.analysis.atlas.tables import MeanInterval
from baldwinlab.analysis.theory.needle import selection_against_unset
from baldwinlab.papers.atlas_design import FOLDER, REGISTERED_FILE, read_atlas

N_RUNS = 12
NOISE = 0.002
CLAIMS = {claim.id: claim for claim in read_atlas().claims}
Maps = dict[str, xr.Dataset]


def make_map(axes: dict[str, Any], **values: Callable[..., Any] | float) -> xr.Dataset:
    """Return a map whose values are functions of the axes, with a little noise of the runs."""
    grid = xr.Dataset(coords={**axes, "run": np.arange(N_RUNS)})
    noise = xr.DataArray(np.random.default_rng(0).normal(0, NOISE, N_RUNS), dims="run")
    shape = xr.DataArray(0.0, coords=grid.coords, dims=[*axes, "run"])
    arrays = {
        name.replace("__", ": "): shape + (value(grid) if callable(value) else value) + noise
        for name, value in values.items()
    }
    return xr.Dataset(arrays).assign_attrs(fields=list(axes))


def _choose(condition: xr.DataArray, value: Any, alternative: Any) -> xr.DataArray:
    """Return `value` where a condition holds, else `alternative`."""
    return xr.zeros_like(condition, float).where(~condition, value).where(condition, alternative)


def evaluate(name: str, maps: Maps) -> str:
    (result,) = evaluate_claims((CLAIMS[name],), maps)
    return result.evaluation.verdict


def make_needle(error: float = 0.0, best_cost: float = 1.0, success: float = 0.9) -> xr.Dataset:
    axes = {
        "moving_needle.cost_of_trials": [0.1, 1.0, 3.0, 10.0],
        "moving_needle.period": [2, 5, 20, 100, 0],
    }
    found = {"measure: succeeded": xr.DataArray(np.ones(N_RUNS), dims="run")}
    return make_map(
        axes,
        measure__unset=lambda grid: LAWS["needle"].predict(grid.assign(found)) + error,
        measure__succeeded=success,
        assimilation=lambda grid: -abs(np.log(grid[COSTS["needle"]] / best_cost)),
        selection_ratio=0.5,
    )


def make_nk(best_cost: float = 0.02, slope: float = -1.0, history: float = 0.1) -> xr.Dataset:
    axes = {K: [0, 5, 10], NK_COST: [0.005, 0.02, 0.05], SELECTION: [TOURNAMENT, ROULETTE]}
    return make_map(
        axes,
        measure__changed=lambda grid: _choose(
            grid[SELECTION] == ROULETTE, 0.1 * grid[NK_COST] ** slope, 0.5
        ),
        assimilation=lambda grid: -abs(np.log(grid[NK_COST] / best_cost)),
        selection_ratio=0.5,
        fork_history=lambda grid: _choose(grid[K] >= 5, history, 0.0),
        fork_regime=-0.1,
    )


def test_x1_holds_on_the_law_and_fails_at_a_distance() -> None:
    assert evaluate("X1", {"needle": make_needle()}) == "holds"
    assert evaluate("X1", {"needle": make_needle(error=0.2)}) == "does not hold"
    # No population finds the needle, so there is no law.
    assert evaluate("X1", {"needle": make_needle(success=0.4)}) == "undecided"


def make_costly(field: str, best: float) -> xr.Dataset:
    return make_map(
        {field: [0.1, 1.0, 10.0]}, assimilation=lambda grid: -abs(np.log(grid[field] / best))
    )


@pytest.mark.parametrize(("best", "verdict"), [(1.0, "holds"), (10.0, "does not hold")])
def test_x2_needs_an_interior_maximum(best: float, verdict: str) -> None:
    maps = {name: make_costly(field, best) for name, field in COSTS.items()}
    assert evaluate("X2", maps) == verdict
    # Models that differ are undecided.
    assert (
        evaluate("X2", {**maps, "nk": make_nk(), "needle": make_costly(COSTS["needle"], 0.1)})
        == "undecided"
    )


def test_claims_about_nk_landscapes_need_their_slope_and_their_effect_of_history() -> None:
    for name, changes, verdict in (
        ("X3", {"slope": -1.0}, "holds"),
        ("X3", {"slope": -0.2}, "does not hold"),
        ("X10", {"history": 0.1}, "holds"),
        ("X3", {"slope": -0.75}, "undecided"),
        ("X10", {"history": -0.1}, "does not hold"),
        ("X10", {"history": 0.0}, "undecided"),
    ):
        assert evaluate(name, {"nk": make_nk(**changes)}) == verdict


@pytest.mark.parametrize(
    ("sign", "verdict"), [(1, "holds"), (0, "undecided"), (-1, "does not hold")]
)
def test_x4_needs_the_sign_of_the_gain(sign: int, verdict: str) -> None:
    axes = {
        CURVATURE: [-1.0, -0.5, 0.0, 0.5, 1.0],
        STEP: [0.3, 0.5, 0.6],
        SELECTION: [ROULETTE, RANK],
    }
    slope = make_map(
        axes,
        innate_response=lambda grid: _choose(
            grid[SELECTION] == ROULETTE, sign * grid[CURVATURE] * grid[STEP], 0.0
        ),
    )
    assert evaluate("X4", {"slope": slope}) == verdict


@pytest.mark.parametrize(
    ("offset", "verdict"), [(0.0, "holds"), (0.15, "undecided"), (1.0, "does not hold")]
)
def test_x5_needs_the_slope_of_each_regime(offset: float, verdict: str) -> None:
    axes = {SHARE: [0.25, 0.5, 0.7], SPEED: [0.01, 0.02]}
    maps = {
        name: make_map(
            # With a cost, the slope is another one.
            {**axes, COSTS[name]: [0.0, 1.0]} if name in COSTS else axes,
            measure__mismatch=lambda grid, name=name, slope=slope: (
                (grid[SPEED] * 100)
                * (1 - grid[SHARE]) ** (-slope - offset - grid.get(COSTS.get(name), 0))
            ),
        )
        for name, slope in REGIME_SLOPES.items()
    }
    assert evaluate("X5", maps) == verdict


@pytest.mark.parametrize(("shift", "verdict"), [(0.0, "holds"), (0.1, "does not hold")])
def test_x6_needs_crossings_at_the_threshold(shift: float, verdict: str) -> None:
    prefix = "two_state_forager."
    axes = {
        f"{prefix}between_persistence": [0.5, 0.7, 0.9],
        f"{prefix}within_persistence": [0.8, 0.9, 0.95],
        f"{prefix}cost": np.arange(0.01, 0.5, 0.02),
    }
    forager = make_map(
        axes,
        measure__learners=lambda grid: (
            1 / (1 + np.exp((grid[f"{prefix}cost"] - predict_threshold(grid) - shift) / 0.01))
        ),
    )
    assert evaluate("X6", {"forager": forager}) == verdict


@pytest.mark.parametrize(
    ("floor", "verdict"), [(0.0, "holds"), (0.05, "undecided"), (0.2, "does not hold")]
)
def test_x7_needs_no_assimilation_without_correlation(floor: float, verdict: str) -> None:
    axes = {CORRELATION: [0.0, 0.5, 1.0], NK_COST: [0.0, 0.02]}
    correlation = make_map(axes, assimilation=lambda grid: floor + 0.5 * grid[CORRELATION])
    assert evaluate("X7", {"correlation": correlation}) == verdict


@pytest.mark.parametrize(
    ("n_models", "sign", "verdict"),
    [(9, 1, "holds"), (9, -1, "does not hold"), (5, -1, "does not hold"), (4, 1, "undecided")],
)
def test_x8_needs_equal_orders_of_p_and_a_in_enough_models(
    n_models: int, sign: int, verdict: str
) -> None:
    names = ["needle", "nk", *"abcdefg"][:n_models]
    maps = {
        name: make_map({"a": [0]}, selection_ratio=ratio, assimilation=sign * ratio)
        for ratio, name in enumerate(names)
    }
    assert evaluate("X8", maps) == verdict


@pytest.mark.parametrize(("threshold", "verdict"), [(2.0, "holds"), (50.0, "does not hold")])
def test_x9_needs_loss_above_the_product(threshold: float, verdict: str) -> None:
    selection = selection_against_unset(1, 100)
    sizes = np.array([0.1, 0.2, 8.0, 10.0]) * 2 / selection
    unset = _choose(xr.DataArray(sizes, dims="population.size") * selection > threshold, 0.0, 0.1)
    data = xr.Dataset(
        {"measure: unset": unset.expand_dims({TRIALS: [100], "run": N_RUNS})},
        {"population.size": sizes},
    )
    assert evaluate("X9", {"needle-size": data}) == verdict


def test_the_interval_of_a_share_ends_at_0_and_1() -> None:
    assert limit_to_shares(MeanInterval(0.2, -1.76, 2.06, 20)) == MeanInterval(0.2, 0, 1, 20)
    undefined = limit_to_shares(MeanInterval(0.2, np.nan, np.nan, 1))
    assert np.isnan(undefined.low) and np.isnan(undefined.high)


def test_fewer_than_six_runs_are_not_a_verdict() -> None:
    axes = {CORRELATION: [0.0, 0.5, 1.0], NK_COST: [0.0, 0.02]}
    correlation = make_map(axes, assimilation=lambda grid: 0.5 * grid[CORRELATION])
    (refused,) = refuse_verdicts((CLAIMS["X7"],), "No verdicts.")
    assert refused.evaluation == ("not evaluated", "No verdicts.", 0)
    few, enough = (
        evaluate_claims((CLAIMS["X7"],), {"correlation": correlation.isel(run=slice(runs))})
        for runs in (5, 6)
    )
    assert few[0].evaluation.verdict == "undecided"
    assert few[0].evaluation.numbers.startswith("Too few runs: a verdict needs 6. rank correlation")
    assert enough[0].evaluation.verdict == "holds"


def test_each_claim_has_an_evaluation_and_a_complete_rule() -> None:
    assert list(CLAIMS) == list(EVALUATIONS)
    assert not any("{" in claim.complete_rule + claim.remarks for claim in CLAIMS.values())
    # A claim about a missing map is not evaluated.
    (result,) = evaluate_claims((CLAIMS["X6"],), {})
    assert result.evaluation == ("not evaluated", "The maps forager are not in this atlas.", 0)


def test_the_registered_claims_are_those_of_their_first_publication() -> None:
    digest = hashlib.sha256((FOLDER / REGISTERED_FILE).read_bytes()).hexdigest()
    assert digest == "33bc7cda5f7158ee854e018fe2b6e5bd0871ad2a1892516009c8081b24c377cc"
    assert CLAIMS["X5"].registered_rule.startswith("Holds if the slope of log mismatch")
    assert "were added after the first confirmatory runs" in CLAIMS["X5"].remarks


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        ((0.5, 1), "must be from 0.5 to 1"),
        ((-np.inf, 0.02), "must be at most 0.02"),
        ((0.9, np.inf), "must be at least 0.9"),
        (ABOVE_ZERO, "must be above 0"),
        (BELOW_ZERO, "must be below 0"),
    ],
)
def test_limits_have_a_text(limits: tuple[float, float], text: str) -> None:
    assert describe_limits(limits) == text


def test_an_effect_of_exactly_0_is_not_above_0() -> None:
    assert ClaimPart("an effect", MeanInterval(0, 0, 0, 6), ABOVE_ZERO).verdict == "does not hold"
