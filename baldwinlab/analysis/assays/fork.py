"""Effects in the fork assay: history, regime and their interaction, with one value per run.

The four branches of a run have the same random numbers, so an effect is a difference within a run.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.statistics import median_interval
from baldwinlab.core.assay_variables import HISTORIES, REGIMES

MEASURES: Final = {"innate_fitness": "innate fitness", "fitness": "fitness in the regime"}
LEARNING_OFF: Final = REGIMES[1]
QUANTITY_PREFIX: Final = "fork: "
EFFECTS: Final = ("history", "regime", "interaction")


class ForkEffect(NamedTuple):
    """Effect in the branches that start in one generation.

    Attributes
    ----------
    generation : int
        Start generation.
    measure : str
        "innate_fitness" or "fitness".
    effect : str
        "history", "regime" or "interaction".
    estimate : float
        Median over runs, in the unit of fitness.
    low, high : float
        95 % bootstrap interval of the median; NaN for a single run.
    runs : int
        Number of runs.
    """

    generation: int
    measure: str
    effect: str
    estimate: float
    low: float
    high: float
    runs: int


def compute_effects(fork: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return the effects of each run, on means over agents at the end of the branches.

    Parameters
    ----------
    fork : xr.Dataset
        The stored assay `fork` or `fork-mode` of one condition.

    Returns
    -------
    dict of str to xr.DataArray
        Effects (run, generation) by name, for example "fork: history, innate fitness".

        - history: learner minus control, in the branches with learning off.
        - regime: learning on minus off, averaged over the histories.
        - interaction: the effect of the regime on the learner minus that on the control.
    """
    return {
        name_quantity(effect, measure): values
        for measure in MEASURES
        for effect, values in _compute_fork_effects(fork[measure].mean("agent")).items()
    }


def name_quantity(effect: str, measure: str) -> str:
    """Return the name of an effect on a measure in the tables of a report."""
    return f"{QUANTITY_PREFIX}{effect}, {MEASURES[measure]}"


def _compute_fork_effects(fitness: xr.DataArray) -> dict[str, xr.DataArray]:
    """Return the effects on a measure (run, generation, history, regime)."""
    learner, control = (fitness.sel(history=name, drop=True) for name in HISTORIES)
    learning_on, learning_off = (fitness.sel(regime=name, drop=True) for name in REGIMES)
    regime_effect = learning_on - learning_off
    effect_on_learner, effect_on_control = (
        regime_effect.sel(history=name, drop=True) for name in HISTORIES
    )
    return {
        # With learning on, selection on innate fitness can be relaxed in both histories.
        "history": (learner - control).sel(regime=LEARNING_OFF, drop=True),
        "regime": regime_effect.mean("history"),
        "interaction": effect_on_learner - effect_on_control,
    }


def estimate_effects(fork: xr.Dataset) -> list[ForkEffect]:
    """Estimate the effects over runs, with their intervals.

    Parameters
    ----------
    fork : xr.Dataset
        The stored assay `fork` or `fork-mode` of one condition.

    Returns
    -------
    list of ForkEffect
        One estimate per start generation, measure and effect.
    """
    estimates = []
    for generation in fork["generation"].values.tolist():
        for measure in MEASURES:
            fitness = fork[measure].sel(generation=generation).mean("agent")
            for effect, values in _compute_fork_effects(fitness).items():
                median = float(np.median(values))
                low, high = median_interval(values.values)
                row = ForkEffect(
                    generation=generation,
                    measure=measure,
                    effect=effect,
                    estimate=median,
                    low=low,
                    high=high,
                    runs=values.size,
                )
                estimates.append(row)
    return estimates
