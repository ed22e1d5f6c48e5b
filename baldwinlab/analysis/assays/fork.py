"""Effects in the fork assay: history, regime and their interaction, with one value per run.

The four branches of a run have the same random numbers, so an effect is a difference within a run.
"""

from __future__ import annotations

from typing import Final

import xarray as xr

from baldwinlab.core.assay_variables import HISTORIES, REGIMES

MEASURES: Final = {"innate_fitness": "innate fitness", "fitness": "fitness in the regime"}
LEARNING_OFF: Final = REGIMES[1]
QUANTITY_PREFIX: Final = "fork: "
EFFECTS: Final = ("history", "regime", "interaction")


def compute_effects(fork: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return the effects of each run by name, on means over agents at the end of the branches.

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
