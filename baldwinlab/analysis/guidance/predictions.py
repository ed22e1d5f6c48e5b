"""Predictions of the study what-guides: each function evaluates one prediction.

An effect is the innate fitness of an arm minus that of the control. All arms evolve through the
same number of common generations without learning before innate fitness is measured. A difference
is thus due to the history of the genomes.

A function returns a verdict, and the deciding numbers as text: estimate, interval and bound. A
landscape is a run. Cells with the same run and the same K have the same landscape, so values are
averaged over the cells of a run before an interval is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Final

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.analysis.atlas.claims import AtlasClaimResult, AtlasEvaluation
from baldwinlab.analysis.atlas.tables import MeanInterval, estimate_mean, is_equivalent
from baldwinlab.analysis.results.numbers import format_estimate
from baldwinlab.analysis.results.verdicts import (
    FAILS,
    HOLDS,
    UNDECIDED,
    Verdict,
    combine_verdicts,
)
from baldwinlab.analysis.statistics.bootstrap import (
    CONFIDENCE_LEVEL,
    RESAMPLES,
    SEED,
    draw_resamples,
    percentile_interval,
)
from baldwinlab.papers.guidance_design import GuidancePrediction

Groups = Mapping[str, xr.Dataset]
"""Cells (cell, run, arm, start, horizon) of each group, with `effect` by `add_effects`."""
Bounds = Mapping[str, float]
Floats = npt.NDArray[np.float64]
# A verdict, and the numbers that decide.
Decision = tuple[Verdict, str]

CONTROL: Final = "control"
EQUAL_EVALUATIONS: Final = "equal-evaluations"
LEARNING: Final = "learning"
K: Final = "nk_climbers.k"
TRIALS: Final = "nk_climbers.trials"
AGENTS: Final = "population.size"
NK: Final = "nk"
LARGE: Final = "nk-large"
CHAIN: Final = "chain"
MAP_A: Final = "le-a"
POPULATION: Final = "population"
NOISE: Final = ["drift", "yoked"]


def name_costly(arm: str) -> str:
    """Return the name of an arm with a cost of learning.

    >>> name_costly("learning")
    'costly-learning'
    """
    return f"costly-{arm}"


COSTLY_LEARNING: Final = name_costly(LEARNING)
COSTS: Final = (COSTLY_LEARNING, LEARNING)


def compute_effects(cells: xr.Dataset, *, is_relative: bool) -> xr.DataArray:
    """Return the effects of all arms but the control (cell, run, arm, start, horizon).

    `is_relative`: divide by the higher mean innate fitness of arm and control over the runs. The
    effect is NaN if both are 0.
    """
    innate = cells["innate"]
    control = innate.sel(arm=CONTROL, drop=True)
    arms = innate.drop_sel(arm=CONTROL)
    effects = arms - control
    if is_relative:
        scale = arms.mean("run").clip(min=control.mean("run"))
        effects = effects / scale.where(scale > 0)
    return effects.transpose(*innate.dims)


def add_effects(cells: xr.Dataset, *, is_relative: bool) -> xr.Dataset:
    """Return the cells with the effects, NaN for the control."""
    return cells.assign(effect=compute_effects(cells, is_relative=is_relative))


def evaluate_predictions(
    predictions: Sequence[GuidancePrediction], groups: Groups, least_runs: int
) -> list[AtlasClaimResult]:
    """Evaluate all predictions, in their order."""
    results = []
    for prediction in predictions:
        names, evaluate = EVALUATIONS[prediction.id]
        verdict, numbers = evaluate(groups, prediction.bounds)
        runs = min(groups[name].sizes["run"] for name in names)
        if runs < least_runs:
            verdict, numbers = UNDECIDED, f"Too few runs: a verdict needs {least_runs}. {numbers}"
        results.append(AtlasClaimResult(prediction, AtlasEvaluation(verdict, numbers, runs)))
    return results


def decide_equivalence(values: xr.DataArray | Floats, bound: float, n_tests: int = 1) -> Verdict:
    """Return whether a mean is within `bound` of 0.

    Holds by two one-sided tests at 5 %. Fails if the interval is outside the bounds; its level is
    corrected for the number of tests, of which one is enough for a failure.
    """
    if is_equivalent(values, bound):
        return HOLDS
    interval = estimate_mean(values, 1 - (1 - CONFIDENCE_LEVEL) / n_tests)
    return FAILS if interval.low > bound or interval.high < -bound else UNDECIDED


def decide_positive(interval: MeanInterval, smallest: float) -> Verdict:
    """Return whether a mean is above 0. Fails if the interval is below the smallest effect."""
    if interval.low > 0:
        return HOLDS
    return FAILS if interval.high < smallest else UNDECIDED


def select_cells(cells: xr.Dataset, bounds: Bounds, **where: Callable[[float], bool]) -> xr.Dataset:
    """Return the cells from populations, with given values of the fields K, TRIALS and AGENTS."""
    fields = {"k": K, "trials": TRIALS, "agents": AGENTS}
    chosen = np.ones(cells.sizes["cell"], np.bool_)
    for name, accepts in where.items():
        chosen &= [accepts(value) for value in cells[fields[name]].values.tolist()]
    selected = cells.isel(cell=np.flatnonzero(chosen)).sel(start=POPULATION)
    return selected.sel(horizon=int(bounds["horizon"])) if "horizon" in bounds else selected


def _evaluate_chain(groups: Groups, bounds: Bounds) -> Decision:
    """Evaluate P1: the effect of learning equals that of the Markov chain."""
    cells = select_cells(groups[CHAIN], bounds)
    predicted = cells["predicted"]
    expected = predicted.sel(history=LEARNING) - predicted.sel(history=CONTROL)
    errors = cells["effect"].sel(arm=LEARNING) - expected
    verdicts, sentences = [], []
    for index, k in enumerate(cells[K].values.tolist()):
        error = errors.isel(cell=index)
        verdicts.append(decide_equivalence(error, bounds["error"], cells.sizes["cell"]))
        sentences.append(
            f"K = {k}: measured {estimate_mean(cells['effect'].sel(arm=LEARNING)[index])}, chain "
            f"{float(expected.isel(cell=index).mean()):.3g}, difference {estimate_mean(error)}"
        )
    return combine_verdicts(verdicts), "; ".join(sentences) + "."


def _evaluate_single_peak(groups: Groups, bounds: Bounds) -> Decision:
    """Evaluate P2: no effect on a single peak after the sweeps, in any population size."""
    samples = {}
    for name in (NK, LARGE):
        smooth = select_cells(groups[name], {}, k=lambda k: k == 0)
        arms = smooth["effect"].sel(arm=[LEARNING, COSTLY_LEARNING])
        for size in np.unique(smooth[AGENTS]).tolist():
            samples[size] = arms.isel(cell=np.flatnonzero(smooth[AGENTS] == size))
    horizons = [h for h in groups[NK]["horizon"].values.tolist() if h >= bounds["horizon"]]
    verdicts, sentences = [], []
    for size, horizon in product(sorted(samples), horizons):
        values = samples[size].sel(horizon=horizon).mean(("cell", "arm"))
        verdicts.append(decide_equivalence(values, bounds["effect"], len(samples) * len(horizons)))
        sentences.append(f"{size} agents, {horizon} generations: {estimate_mean(values)}")
    return combine_verdicts(verdicts), "; ".join(sentences) + "."


def _evaluate_cost(groups: Groups, bounds: Bounds) -> Decision:
    """Evaluate P3: the effect with a cost equals that without a cost."""
    effects = _select_rugged(groups, bounds)["effect"]
    differences = (effects.sel(arm=COSTLY_LEARNING) - effects.sel(arm=LEARNING)).mean("cell")
    costly, free = (estimate_mean(effects.sel(arm=arm).mean("cell")) for arm in COSTS)
    numbers = f"With a cost {costly}, without {free}, difference {estimate_mean(differences)}."
    return decide_equivalence(differences, bounds["difference"]), numbers


def _evaluate_noise(groups: Groups, bounds: Bounds) -> Decision:
    """Evaluate P4: the ratio of noise to learning falls with K."""
    effects = _select_rugged(groups, bounds)["effect"]
    by_k = effects.groupby(K).mean("cell")
    noise = by_k.sel(arm=NOISE).mean("arm").transpose("run", K).values
    learning = by_k.sel(arm=LEARNING).transpose("run", K).values
    k = by_k[K].values.astype(np.float64)
    centered = (k - k.mean()) / ((k - k.mean()) ** 2).sum()
    resamples = draw_resamples(np.random.default_rng(SEED), RESAMPLES, len(noise))
    # An effect of learning of 0 gives no ratio. The prediction is undecided then.
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = noise.mean(axis=0) / learning.mean(axis=0)
        by_resample = [noise[rows].mean(axis=1) / learning[rows].mean(axis=1) for rows in resamples]
    slopes = np.concatenate(by_resample) @ centered
    low, high = percentile_interval(slopes)
    shares = ", ".join(
        f"{ratio:.2f} at K = {level:g}" for ratio, level in zip(ratios, k, strict=True)
    )
    slope = format_estimate(float(ratios @ centered), low, high, digits=3)
    numbers = f"Ratio {shares}; slope {slope} per K."
    weakest = min(estimate_mean(values).low for values in learning.T)
    if weakest <= 0:
        return UNDECIDED, f"{numbers} The effect of learning is not above 0 at every K."
    if high < 0:
        return HOLDS, numbers
    return (FAILS if low > -bounds["slope"] else UNDECIDED), numbers


def _evaluate_time(groups: Groups, bounds: Bounds) -> Decision:
    """Evaluate P5: learning has a larger effect than equal evaluations."""
    effects = _select_rugged(groups, bounds)["effect"]
    remainder = effects.sel(arm=LEARNING) - effects.sel(arm=EQUAL_EVALUATIONS)
    pooled = estimate_mean(remainder.mean("cell"))
    by_k = remainder.groupby(K).mean("cell")
    parts = "; ".join(
        f"K = {k}: {estimate_mean(by_k.sel({K: k}))}" for k in by_k[K].values.tolist()
    )
    return decide_positive(pooled, bounds["effect"]), f"All K: {pooled}. {parts}."


def _evaluate_map_a(groups: Groups, bounds: Bounds) -> Decision:
    """Evaluate P6: the effect is negative on map A."""
    cells = groups[MAP_A].isel(cell=0).sel(start=POPULATION, arm=LEARNING)
    horizons = {
        horizon: estimate_mean(-cells["effect"].sel(horizon=horizon))
        for horizon in cells["horizon"].values.tolist()
    }
    interval = horizons[int(bounds["horizon"])]
    numbers = "; ".join(
        f"{horizon} generations: {MeanInterval(-at.mean, -at.high, -at.low, at.runs)}"
        for horizon, at in horizons.items()
    )
    return decide_positive(interval, bounds["effect"]), f"{numbers}."


def _select_rugged(groups: Groups, bounds: Bounds) -> xr.Dataset:
    """Return the cells of the group NK with the number of agents and the smallest K and trials."""
    return select_cells(
        groups[NK],
        bounds,
        k=lambda k: k >= bounds["k"],
        trials=lambda trials: trials >= bounds["trials"],
        agents=lambda agents: agents == bounds["agents"],
    )


EVALUATIONS: Final[Mapping[str, tuple[Sequence[str], Callable[[Groups, Bounds], Decision]]]] = {
    "P1": ((CHAIN,), _evaluate_chain),
    "P2": ((NK, LARGE), _evaluate_single_peak),
    "P3": ((NK,), _evaluate_cost),
    "P4": ((NK,), _evaluate_noise),
    "P5": ((NK,), _evaluate_time),
    "P6": ((MAP_A,), _evaluate_map_a),
}
"""Groups of each prediction, and the function that evaluates it."""
