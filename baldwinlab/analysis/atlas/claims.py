"""Claims of the atlas: each function evaluates one claim on the confirmatory runs.

A function returns a verdict and the deciding numbers as a text. Too few cells give "undecided".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from scipy import stats

from baldwinlab.analysis.atlas.laws import LAWS, predict_threshold
from baldwinlab.analysis.atlas.outcomes import MEASURE_PREFIX
from baldwinlab.analysis.atlas.tables import estimate_mean, estimate_slope, is_equivalent
from baldwinlab.analysis.results.verdicts import FAILS, HOLDS, NOT_EVALUATED, UNDECIDED, Verdict
from baldwinlab.analysis.statistics.significance import MIN_INTERVAL_RUNS
from baldwinlab.analysis.theory.needle import selection_against_unset
from baldwinlab.papers.atlas_design import AtlasClaim

Maps = Mapping[str, xr.Dataset]
"""Outcomes and measures of each map (swept fields, run), confirmatory runs only."""

K: Final = "nk_climbers.k"
NK_COST: Final = "nk_climbers.cost_per_bit"
CORRELATION: Final = "nk_climbers.correlation"
SELECTION: Final = "evolution.selection"
TOURNAMENT: Final = "larger-tournament"
ROULETTE: Final = "roulette"
RANK: Final = "rank"
TRIALS: Final = "hinton_nowlan.trials"
SHARE: Final = "moving_optimum.learned_share"
SPEED: Final = "moving_optimum.speed"
COSTS: Final = {
    "needle": "moving_needle.cost_of_trials",
    "nk": NK_COST,
    "forager": "two_state_forager.cost",
    "optimum-mutation": "moving_optimum.cost",
    "miniworld": "learning.cost_per_change",
}
"""Cost of learning of each model that has one."""
STEP: Final = "slope_climbers.learning_step"
CURVATURE: Final = "slope_climbers.curvature"
REGIME_SLOPES: Final = {"optimum-constant": 1, "optimum-mutation": 0, "optimum-rare": -1}
"""Predicted slope of log mismatch on log 1 / (1 - a), by map. a is the learned share."""


class AtlasEvaluation(NamedTuple):
    """Result of a claim."""

    verdict: Verdict
    numbers: str  # The numbers that decide, in one sentence.
    runs: int  # Smallest number of runs of a cell.


class AtlasClaimResult(NamedTuple):
    """A claim with its result."""

    claim: AtlasClaim
    evaluation: AtlasEvaluation


def evaluate_claims(claims: tuple[AtlasClaim, ...], maps: Maps) -> list[AtlasClaimResult]:
    """Evaluate all claims, in their order."""
    results = []
    for claim in claims:
        names, evaluate = EVALUATIONS[claim.id]
        missing = [name for name in names if name not in maps]
        if missing:
            reason = f"The maps {', '.join(missing)} are not in this atlas."
            results.append(AtlasClaimResult(claim, AtlasEvaluation(NOT_EVALUATED, reason, 0)))
            continue
        n_runs = min(maps[name].sizes["run"] for name in names)
        verdict, numbers = evaluate(maps, claim.bounds)
        if n_runs < MIN_INTERVAL_RUNS:
            verdict = UNDECIDED
            numbers = f"Too few runs: a verdict needs {MIN_INTERVAL_RUNS}. {numbers}"
        results.append(AtlasClaimResult(claim, AtlasEvaluation(verdict, numbers, n_runs)))
    return results


# A verdict, and the numbers that decide.
Decision = tuple[Verdict, str]
# Limits of a claim by name, for example {"error": 0.07}.
Bounds = Mapping[str, float]


def _decide(holds: bool) -> Verdict:
    return HOLDS if holds else FAILS


def _evaluate_balance(maps: Maps, bounds: Bounds) -> Decision:
    """Evaluate X1: the residual share of undefined alleles ? on the needle."""
    needle = maps["needle"]
    measured = needle[MEASURE_PREFIX + "unset"].mean("run")
    success = needle[MEASURE_PREFIX + "succeeded"].mean("run")
    cells = xr.Dataset(
        {"measured": measured, "law": LAWS["needle"].predict(needle), "success": success}
    )
    table = cells.to_dataframe().query("success >= @bounds['success']")
    if len(table) < 3:
        return UNDECIDED, f"{len(table)} cells take off, and the claim needs 3."
    error = (table["measured"] - table["law"]).abs()
    share = float((error <= bounds["error"]).mean())
    correlation = float(stats.spearmanr(table["measured"], table["law"]).statistic)
    numbers = (
        f"{len(table)} of {measured.size} cells take off; {share:.0%} of them are within "
        f"{bounds['error']} of the law (mean error {error.mean():.3f}, largest "
        f"{error.max():.3f}), and Spearman's correlation is {correlation:.2f}."
    )
    holds = share >= bounds["cells"] and correlation >= bounds["correlation"]
    return _decide(holds), numbers


def _evaluate_interior_cost(maps: Maps, bounds: Bounds) -> Decision:
    """Evaluate X2: the cost at which assimilation is highest."""
    sentences = []
    n_interior = 0
    present = {name: field for name, field in COSTS.items() if name in maps}
    for name, field in present.items():
        other_axes = [dim for dim in maps[name]["assimilation"].dims if dim not in (field, "run")]
        by_cost = maps[name]["assimilation"].mean(other_axes)
        means = by_cost.mean("run")
        if bool(means.isnull().any()):
            sentences.append(f"{name}: A is not defined at every cost")
            continue
        best = int(means.values.argmax())
        gains = [estimate_mean(by_cost[best] - by_cost[end]) for end in (0, -1)]  # Both ends.
        is_interior = 0 < best < means.size - 1 and all(gain.low > 0 for gain in gains)
        n_interior += is_interior
        sentences.append(
            f"{name}: highest at {float(means[field][best]):g}, {gains[0]} above the lowest and "
            f"{gains[1]} above the highest cost"
        )
    return _decide(n_interior >= bounds["models"]), "; ".join(sentences) + "."


def _evaluate_cost_of_bits(maps: Maps, bounds: Bounds) -> Decision:
    """Evaluate X3: residual learning against the cost, by selection scheme."""
    bits = maps["nk"][MEASURE_PREFIX + "changed"].mean(K)
    paid = bits.sel({NK_COST: bits[NK_COST] > 0})
    if paid.sizes[NK_COST] < 2:
        return UNDECIDED, "The map has fewer than two costs above 0."
    tournament, roulette = (paid.sel({SELECTION: name}) for name in (TOURNAMENT, ROULETTE))
    differences = tournament.isel({NK_COST: -1}) - tournament.isel({NK_COST: 0})
    slope = estimate_slope(
        np.log(paid[NK_COST].values), xr.DataArray(np.log(roulette.where(roulette > 0))), NK_COST
    )
    numbers = (
        f"Tournament: {estimate_mean(differences)} bits from the lowest to the highest cost; "
        f"roulette: slope {slope}."
    )
    is_flat = is_equivalent(differences, bounds["bits"])
    is_inverse = abs(slope.low + 1) <= bounds["slope"] and abs(slope.high + 1) <= bounds["slope"]
    return _decide(is_flat and is_inverse), numbers


def _evaluate_gain(maps: Maps, bounds: Bounds) -> Decision:
    """Evaluate X4: the sign of the innate response on smooth slopes."""
    slope = maps["slope"].sel({SELECTION: ROULETTE})
    response = slope["innate_response"].mean("run")
    # The gain g from learning at the trait x: log g(x) is a constant plus step * curvature * x.
    change = (slope[STEP] * slope[CURVATURE]).broadcast_like(response)
    is_tested = (change != 0) & response.notnull()
    agrees = (np.sign(response) == np.sign(change)).where(is_tested)
    share = float(agrees.mean())
    ranked = maps["slope"]["innate_response"].sel({SELECTION: RANK})
    cells = ranked.stack(cell=[CURVATURE, STEP]).transpose("cell", "run")
    n_equivalent = sum(is_equivalent(values, bounds["response"]) for values in cells)
    numbers = (
        f"Roulette: the signs agree in {int(agrees.sum())} of {int(is_tested.sum())} cells with a "
        f"changing gain. Ranks: the response is equivalent to 0 in {n_equivalent} of {len(cells)} "
        "cells."
    )
    return _decide(share >= bounds["cells"] and n_equivalent == len(cells)), numbers


def _evaluate_mismatch(maps: Maps, bounds: Bounds) -> Decision:
    """Evaluate X5: the mismatch after learning in three regimes of variance."""
    sentences = []
    holds = True
    for name, predicted in REGIME_SLOPES.items():
        mismatch = maps[name][MEASURE_PREFIX + "mismatch"].sel({SPEED: maps[name][SPEED] > 0})
        # The predicted slopes apply without a cost, but one of the maps varies the cost.
        mismatch = mismatch.sel({COSTS[name]: 0}) if name in COSTS else mismatch
        log_mismatch = xr.DataArray(np.log(mismatch)).mean(SPEED)
        strength = -np.log(1 - mismatch[SHARE].values)  # log 1 / (1 - a)
        slope = estimate_slope(strength, log_mismatch, SHARE)
        holds &= max(abs(slope.low - predicted), abs(slope.high - predicted)) <= bounds["slope"]
        sentences.append(f"{name}: slope {slope}, predicted {predicted}")
    return _decide(holds), "; ".join(sentences) + "."


def _evaluate_threshold(maps: Maps, bounds: Bounds) -> Decision:
    """Evaluate X6: the cost at which half of the agents have the learning allele."""
    forager = maps["forager"]
    cost = COSTS["forager"]
    frequency = forager[MEASURE_PREFIX + "learners"].mean("run")
    threshold = predict_threshold(forager)
    # The pairs of persistences, between and within lives.
    pairs = [dim for dim in frequency.dims if dim != cost]
    errors = []
    for key, curve in frequency.stack(pair=pairs).groupby("pair"):
        predicted = float(threshold.stack(pair=pairs).sel(pair=key).mean())
        costs = curve[cost].values
        if not costs[0] < predicted < costs[-1]:
            continue
        errors.append(_find_crossing(costs, curve.values.ravel()) - predicted)
    if not errors:
        return UNDECIDED, "No threshold is between the tested costs."
    largest = float(np.max(np.abs(np.nan_to_num(errors, nan=np.inf))))  # NaN: no crossing.
    n_close = int((np.abs(errors) <= bounds["cost"]).sum())
    numbers = (
        f"{n_close} of {len(errors)} thresholds are within {bounds['cost']}; the largest error is "
        f"{largest:.3f}."
    )
    return _decide(n_close == len(errors)), numbers


def _find_crossing(costs: Any, frequencies: Any) -> float:
    """Return the first cost at which the frequency falls through 1/2, interpolated, or NaN."""
    for index in range(len(costs) - 1):
        before, after = frequencies[index], frequencies[index + 1]
        if before >= 0.5 > after:
            weight = (before - 0.5) / (before - after)
            return float(costs[index] + weight * (costs[index + 1] - costs[index]))
    return float("nan")


def _evaluate_correlation(maps: Maps, bounds: Bounds) -> Decision:
    """Evaluate X7: assimilation against the correlation of genotype and phenotype."""
    share = maps["correlation"]["assimilation"]
    positive = share.sel({CORRELATION: share[CORRELATION] > 0}).mean(NK_COST)
    levels = positive[CORRELATION].values
    ranks = [
        float(stats.spearmanr(levels, values).statistic)
        for values in positive.transpose("run", CORRELATION).values
    ]
    rise = estimate_mean(np.array(ranks))
    absent = [
        estimate_mean(share.sel({CORRELATION: 0, NK_COST: cost})) for cost in share[NK_COST].values
    ]
    numbers = f"Rank correlation {rise}; A without correlation: " + ", ".join(
        f"{interval} at a cost of {cost:g}"
        for interval, cost in zip(absent, share[NK_COST].values, strict=True)
    )
    is_absent = all(max(abs(x.low), abs(x.high)) <= bounds["share"] for x in absent)
    return _decide(rise.low > 0 and is_absent), numbers + "."


def _evaluate_order(maps: Maps, bounds: Bounds) -> Decision:
    """Evaluate X8: the order of the models by selection ratio P and by assimilation A."""
    means = {
        name: (float(data["selection_ratio"].mean()), float(data["assimilation"].mean()))
        for name, data in maps.items()
    }
    defined = {name: pair for name, pair in means.items() if np.isfinite(pair).all()}
    if len(defined) < 4:
        return UNDECIDED, f"P and A are defined in {len(defined)} maps, and the claim needs 4."
    ratios, shares = zip(*defined.values(), strict=True)
    tau = float(stats.kendalltau(ratios, shares).statistic)
    listed = ", ".join(f"{name} {p:.2f} and {a:.2f}" for name, (p, a) in defined.items())
    return _decide(tau > bounds["tau"]), f"Kendall's tau {tau:.2f}; P and A: {listed}."


def _evaluate_fixation(maps: Maps, bounds: Bounds) -> Decision:
    """Evaluate X9: the loss of the last undefined allele without mutation."""
    unset = maps["needle-size"][MEASURE_PREFIX + "unset"]
    selection = xr.apply_ufunc(
        np.vectorize(lambda trials: selection_against_unset(1, trials)), unset[TRIALS]
    )
    products = (unset["population.size"] * selection).stack(cell=["population.size", TRIALS])
    # Fraction of runs without an undefined allele.
    lost = (unset == 0).mean("run").stack(cell=["population.size", TRIALS])
    is_above = products >= 2 * bounds["product"]  # Products near the bound are not tested.
    is_below = products <= bounds["product"] / 2
    # `where` replaces the other cells by a value that satisfies the condition.
    holds = bool((lost.where(is_above, 1) > 0.5).all() and (lost.where(is_below, 0) < 0.5).all())
    numbers = "; ".join(
        f"N s(1) = {float(product):.2g}: {float(share):.0%} of the runs have lost it"
        for product, share in sorted(zip(products.values, lost.values, strict=True))
    )
    return _decide(holds and bool(is_above.any() and is_below.any())), numbers + "."


def _evaluate_fork(maps: Maps, bounds: Bounds) -> Decision:
    """Evaluate X10: effects of history and of learning now on NK landscapes."""
    nk = maps["nk"].sel({SELECTION: TOURNAMENT})
    nk = nk.sel({NK_COST: nk[NK_COST] <= bounds["cost"]})
    history = nk["fork_history"]
    rugged = history.sel({K: history[K] >= 5})
    flat = history.sel({K: 0})
    costs = history[NK_COST].values
    is_above = [
        estimate_mean(rugged.sel({K: k, NK_COST: c})).low > 0
        for k in rugged[K].values
        for c in costs
    ]
    is_flat = [is_equivalent(flat.sel({NK_COST: c}), bounds["effect"]) for c in costs]
    is_constant = [
        is_equivalent(
            rugged.sel({NK_COST: c}).mean(K) - rugged.isel({NK_COST: 0}).mean(K), bounds["effect"]
        )
        for c in costs[1:]
    ]
    regimes = nk["fork_regime"].stack(cell=[K, NK_COST]).transpose("cell", "run")
    is_raised = [estimate_mean(values).low > 0 for values in regimes]
    numbers = (
        f"History is above 0 in {sum(is_above)} of {len(is_above)} cells with K of at least 5 "
        f"(mean {estimate_mean(rugged.mean((K, NK_COST)))}) and equivalent to 0 in {sum(is_flat)} "
        f"of {len(is_flat)} cells with K = 0; {sum(is_constant)} of {len(is_constant)} costs are "
        f"equivalent to the lowest; learning now raises innate fitness in {sum(is_raised)} of "
        f"{len(is_raised)} cells."
    )
    holds = all(is_above) and all(is_flat) and all(is_constant) and not any(is_raised)
    return _decide(holds), numbers


EVALUATIONS: Final[Mapping[str, tuple[tuple[str, ...], Callable[[Maps, Bounds], Decision]]]] = {
    "X1": (("needle",), _evaluate_balance),
    "X2": (("needle", "nk"), _evaluate_interior_cost),
    "X3": (("nk",), _evaluate_cost_of_bits),
    "X4": (("slope",), _evaluate_gain),
    "X5": (tuple(REGIME_SLOPES), _evaluate_mismatch),
    "X6": (("forager",), _evaluate_threshold),
    "X7": (("correlation",), _evaluate_correlation),
    "X8": (("needle", "nk"), _evaluate_order),
    "X9": (("needle-size",), _evaluate_fixation),
    "X10": (("nk",), _evaluate_fork),
}
"""Names of the needed maps, and the function, by id of the claim."""
