"""Claims of the atlas: each function estimates the quantities of one claim.

A claim has one or more parts. A part is an estimate on the confirmatory runs with its 95 %
interval, and the limits in which the estimate must be. A part holds if its interval is in the
limits, does not hold if the interval is completely outside, and is undecided otherwise. A claim
holds if all its parts hold, and does not hold if one of them does not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from sys import float_info
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from scipy import stats

from baldwinlab.analysis.atlas.laws import LAWS, predict_threshold
from baldwinlab.analysis.atlas.outcomes import MEASURE_PREFIX
from baldwinlab.analysis.atlas.tables import (
    MeanInterval,
    estimate_correlation,
    estimate_mean,
    estimate_slope,
    pool_cells,
)
from baldwinlab.analysis.results.verdicts import (
    NOT_EVALUATED,
    UNDECIDED,
    Verdict,
    combine_verdicts,
    decide_limits,
)
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
Limits = tuple[float, float]
ABOVE_ZERO: Final[Limits] = (float_info.min, inf)
BELOW_ZERO: Final[Limits] = (-inf, -float_info.min)


class ClaimPart(NamedTuple):
    """A part of a claim."""

    quantity: str  # The estimated quantity.
    estimate: MeanInterval
    limits: Limits  # The smallest and the largest value with which the part holds.

    @property
    def verdict(self) -> Verdict:
        """Verdict on this part."""
        return decide_limits(self.estimate.low, self.estimate.high, *self.limits)

    def describe(self) -> str:
        """Return the estimate, the limits and the verdict as text."""
        return f"{self.quantity}: {self.estimate}, {describe_limits(self.limits)} ({self.verdict})"


def describe_limits(limits: Limits) -> str:
    """Return the limits of a claim, such as "must be at least 0.9"."""
    lowest, highest = limits
    if limits in (ABOVE_ZERO, BELOW_ZERO):
        return "must be above 0" if limits == ABOVE_ZERO else "must be below 0"
    if lowest == -inf:
        return f"must be at most {highest:.3g}"
    if highest == inf:
        return f"must be at least {lowest:.3g}"
    return f"must be from {lowest:.3g} to {highest:.3g}"


class AtlasEvaluation(NamedTuple):
    """Result of a claim."""

    verdict: Verdict
    numbers: str  # The estimates that decide, with their limits.
    runs: int  # Smallest number of runs of a cell.


class AtlasClaimResult(NamedTuple):
    """A claim with its result."""

    claim: AtlasClaim
    evaluation: AtlasEvaluation


def evaluate_claims(claims: tuple[AtlasClaim, ...], maps: Maps) -> list[AtlasClaimResult]:
    """Evaluate all claims, in their order."""
    return [AtlasClaimResult(claim, _evaluate_claim(claim, maps)) for claim in claims]


def refuse_verdicts(claims: tuple[AtlasClaim, ...], reason: str) -> list[AtlasClaimResult]:
    """Return all claims as not evaluated, in their order."""
    evaluation = AtlasEvaluation(NOT_EVALUATED, reason, 0)
    return [AtlasClaimResult(claim, evaluation) for claim in claims]


def _evaluate_claim(claim: AtlasClaim, maps: Maps) -> AtlasEvaluation:
    names, estimate = EVALUATIONS[claim.id]
    missing = [name for name in names if name not in maps]
    if missing:
        reason = f"The maps {', '.join(missing)} are not in this atlas."
        return AtlasEvaluation(NOT_EVALUATED, reason, 0)
    n_runs = min(maps[name].sizes["run"] for name in names)
    parts = estimate(maps, claim.bounds)
    numbers = "; ".join(part.describe() for part in parts) + "."
    if n_runs < MIN_INTERVAL_RUNS:
        numbers = f"Too few runs: a verdict needs {MIN_INTERVAL_RUNS}. {numbers}"
        return AtlasEvaluation(UNDECIDED, numbers, n_runs)
    return AtlasEvaluation(combine_verdicts([part.verdict for part in parts]), numbers, n_runs)


# Limits of a claim by name, for example {"error": 0.034}.
Bounds = Mapping[str, float]


def _estimate_balance(maps: Maps, bounds: Bounds) -> list[ClaimPart]:
    """Estimate X1: the residual share of undefined alleles on the needle, and its law."""
    law = LAWS["needle"]
    measured, predicted = law.measured(maps["needle"]).mean("run"), law.predict(maps["needle"])
    cells = xr.Dataset({"measured": measured, "law": predicted}).to_dataframe().dropna()
    errors = (cells["measured"] - cells["law"]).to_numpy()
    scope = f"{len(cells)} of {measured.size} cells"
    return [
        ClaimPart(
            f"mean absolute error in {scope} (mean error {estimate_mean(errors)})",
            estimate_mean(np.abs(errors)),
            (-inf, bounds["error"]),
        ),
        ClaimPart(
            "Spearman's correlation of cells",
            estimate_correlation(cells["measured"].to_numpy(), cells["law"].to_numpy(), "spearman"),
            (bounds["correlation"], inf),
        ),
    ]


def _estimate_interior_cost(maps: Maps, bounds: Bounds) -> list[ClaimPart]:
    """Estimate X2: assimilation at intermediate costs minus that at both ends, over models."""
    contrasts: dict[str, list[xr.DataArray]] = {"lowest": [], "highest": []}
    for name, field in COSTS.items():
        if name not in maps:
            continue
        shares = maps[name]["assimilation"]
        by_cost = shares.mean([dim for dim in shares.dims if dim not in (field, "run")])
        interior = by_cost.isel({field: slice(1, -1)}).mean(field)
        for end, index in (("lowest", 0), ("highest", -1)):
            difference = interior - by_cost.isel({field: index}, drop=True)
            contrasts[end].append(difference.expand_dims(model=[name]))
    parts = []
    for end, models in contrasts.items():
        values = xr.concat(models, "model")
        means = zip(values["model"].values, values.mean("run").values, strict=True)
        by_model = ", ".join(f"{name} {mean:.2g}" for name, mean in means)
        quantity = f"A at intermediate costs minus A at the {end} cost ({by_model})"
        parts.append(ClaimPart(quantity, pool_cells(values), ABOVE_ZERO))
    return parts


def _estimate_cost_of_bits(maps: Maps, bounds: Bounds) -> list[ClaimPart]:
    """Estimate X3: residual learning against the cost, by selection scheme."""
    bits = maps["nk"][MEASURE_PREFIX + "changed"].mean(K)
    paid = bits.sel({NK_COST: bits[NK_COST] > 0})
    tournament, roulette = (paid.sel({SELECTION: name}) for name in (TOURNAMENT, ROULETTE))
    differences = tournament.isel({NK_COST: -1}) - tournament.isel({NK_COST: 0})
    slope = estimate_slope(
        np.log(paid[NK_COST].values), xr.DataArray(np.log(roulette.where(roulette > 0))), NK_COST
    )
    return [
        ClaimPart(
            "tournament, bits at the highest minus those at the lowest cost above 0",
            estimate_mean(differences),
            (-bounds["bits"], bounds["bits"]),
        ),
        ClaimPart(
            "roulette, slope of log bits on log cost",
            slope,
            (-1 - bounds["slope"], -1 + bounds["slope"]),
        ),
    ]


def _estimate_gain(maps: Maps, bounds: Bounds) -> list[ClaimPart]:
    """Estimate X4: the innate response on smooth slopes, by the change of the gain."""
    slope = maps["slope"].sel({SELECTION: ROULETTE})
    response = slope["innate_response"]
    # The gain g from learning at the trait x: log g(x) is a constant plus step * curvature * x.
    change = slope[STEP] * slope[CURVATURE]
    ranked = maps["slope"]["innate_response"].sel({SELECTION: RANK}, drop=True)
    return [
        ClaimPart("I where the gain rises", pool_cells(response.where(change > 0)), ABOVE_ZERO),
        ClaimPart("I where the gain falls", pool_cells(response.where(change < 0)), BELOW_ZERO),
        ClaimPart(
            "I under selection by ranks",
            pool_cells(ranked),
            (-bounds["response"], bounds["response"]),
        ),
    ]


def _estimate_mismatch(maps: Maps, bounds: Bounds) -> list[ClaimPart]:
    """Estimate X5: the mismatch after learning in three regimes of variance."""
    parts = []
    for name, predicted in REGIME_SLOPES.items():
        mismatch = maps[name][MEASURE_PREFIX + "mismatch"].sel({SPEED: maps[name][SPEED] > 0})
        # The predicted slopes apply without a cost, but one of the maps varies the cost.
        mismatch = mismatch.sel({COSTS[name]: 0}) if name in COSTS else mismatch
        log_mismatch = xr.DataArray(np.log(mismatch)).mean(SPEED)
        strength = -np.log(1 - mismatch[SHARE].values)  # log 1 / (1 - a)
        slope = estimate_slope(strength, log_mismatch, SHARE)
        limits = (predicted - bounds["slope"], predicted + bounds["slope"])
        parts.append(ClaimPart(f"{name}, slope", slope, limits))
    return parts


def _estimate_threshold(maps: Maps, bounds: Bounds) -> list[ClaimPart]:
    """Estimate X6: the cost at which half of the agents have the learning allele."""
    forager = maps["forager"]
    cost = COSTS["forager"]
    frequency = forager[MEASURE_PREFIX + "learners"].mean("run")
    threshold = predict_threshold(forager)
    # The pairs of persistences, between and within lives.
    pairs = [dim for dim in frequency.dims if dim != cost]
    costs = frequency[cost].values
    errors = []
    for key, curve in frequency.stack(pair=pairs).groupby("pair"):
        predicted = float(threshold.stack(pair=pairs).sel(pair=key).mean())
        if costs[0] < predicted < costs[-1]:
            errors.append(_find_crossing(costs, curve.values.ravel()) - predicted)
    # Without a crossing, the error is that of the largest possible distance.
    distances = np.abs(np.nan_to_num(errors, nan=np.ptp(costs)))
    quantity = f"mean distance of {len(errors)} thresholds from c*"
    return [ClaimPart(quantity, estimate_mean(distances), (-inf, bounds["cost"]))]


def _find_crossing(costs: Any, frequencies: Any) -> float:
    """Return the first cost at which the frequency falls through 1/2, interpolated, or NaN."""
    for index in range(len(costs) - 1):
        before, after = frequencies[index], frequencies[index + 1]
        if before >= 0.5 > after:
            weight = (before - 0.5) / (before - after)
            return float(costs[index] + weight * (costs[index + 1] - costs[index]))
    return float("nan")


def _estimate_correlation(maps: Maps, bounds: Bounds) -> list[ClaimPart]:
    """Estimate X7: assimilation against the correlation of genotype and phenotype."""
    share = maps["correlation"]["assimilation"]
    positive = share.sel({CORRELATION: share[CORRELATION] > 0}).mean(NK_COST)
    levels = positive[CORRELATION].values
    ranks = [
        float(stats.spearmanr(levels, values).statistic)
        for values in positive.transpose("run", CORRELATION).values
    ]
    return [
        ClaimPart(
            "rank correlation of A and the correlation", estimate_mean(np.array(ranks)), ABOVE_ZERO
        ),
        *(
            ClaimPart(
                f"A without correlation at a cost of {cost:g}",
                estimate_mean(share.sel({CORRELATION: 0, NK_COST: cost})),
                (-bounds["share"], bounds["share"]),
            )
            for cost in share[NK_COST].values
        ),
    ]


def _estimate_order(maps: Maps, bounds: Bounds) -> list[ClaimPart]:
    """Estimate X8: the order of the models by selection ratio P and by assimilation A."""
    means = {
        name: (float(data["selection_ratio"].mean()), float(data["assimilation"].mean()))
        for name, data in maps.items()
    }
    defined = {name: pair for name, pair in means.items() if np.isfinite(pair).all()}
    ratios, shares = np.array([*defined.values()]).reshape(-1, 2).T
    listed = ", ".join(f"{name} {p:.2f} and {a:.2f}" for name, (p, a) in defined.items())
    quantity = f"Kendall's tau of {len(defined)} maps (P and A: {listed})"
    return [
        ClaimPart(quantity, estimate_correlation(ratios, shares, "kendall"), (bounds["tau"], inf))
    ]


def _estimate_fixation(maps: Maps, bounds: Bounds) -> list[ClaimPart]:
    """Estimate X9: the loss of the last undefined allele without mutation."""
    unset = maps["needle-size"][MEASURE_PREFIX + "unset"]
    selection = xr.apply_ufunc(
        np.vectorize(lambda trials: selection_against_unset(1, trials)), unset[TRIALS]
    )
    products = unset["population.size"] * selection
    is_lost = (unset == 0).astype(float)
    above, below = 2 * bounds["product"], bounds["product"] / 2
    return [
        ClaimPart(
            f"share of runs that have lost it at N s(1) of at least {above:g}",
            limit_to_shares(pool_cells(is_lost.where(products >= above))),
            (0.5, inf),
        ),
        ClaimPart(
            f"share at N s(1) of at most {below:g}",
            limit_to_shares(pool_cells(is_lost.where(products <= below))),
            (-inf, 0.5),
        ),
    ]


def limit_to_shares(interval: MeanInterval) -> MeanInterval:
    """Return the interval of a share, which is from 0 to 1."""
    low, high = np.clip([interval.low, interval.high], 0, 1).tolist()
    return interval._replace(low=low, high=high)


def _estimate_fork(maps: Maps, bounds: Bounds) -> list[ClaimPart]:
    """Estimate X10: effects of history and of learning now on NK landscapes."""
    nk = maps["nk"].sel({SELECTION: TOURNAMENT}, drop=True)
    nk = nk.sel({NK_COST: nk[NK_COST] <= bounds["cost"]})
    history = nk["fork_history"]
    rugged = history.sel({K: history[K] >= 5})
    bound = (-bounds["effect"], bounds["effect"])
    costs = history[NK_COST].values
    changes = [
        ClaimPart(
            f"history at the cost {cost:g} minus that at {costs[0]:g}",
            pool_cells(rugged.sel({NK_COST: cost}) - rugged.sel({NK_COST: costs[0]})),
            bound,
        )
        for cost in costs[1:]
    ]
    return [
        ClaimPart("history, K of at least 5", pool_cells(rugged), ABOVE_ZERO),
        ClaimPart("history, K = 0", pool_cells(history.sel({K: 0})), bound),
        *changes,
        ClaimPart("learning now", pool_cells(nk["fork_regime"]), (-inf, 0)),
    ]


EVALUATIONS: Final[
    Mapping[str, tuple[tuple[str, ...], Callable[[Maps, Bounds], list[ClaimPart]]]]
] = {
    "X1": (("needle",), _estimate_balance),
    "X2": (("needle", "nk"), _estimate_interior_cost),
    "X3": (("nk",), _estimate_cost_of_bits),
    "X4": (("slope",), _estimate_gain),
    "X5": (tuple(REGIME_SLOPES), _estimate_mismatch),
    "X6": (("forager",), _estimate_threshold),
    "X7": (("correlation",), _estimate_correlation),
    "X8": (("needle", "nk"), _estimate_order),
    "X9": (("needle-size",), _estimate_fixation),
    "X10": (("nk",), _estimate_fork),
}
"""Names of the needed maps, and the function, by id of the claim."""
