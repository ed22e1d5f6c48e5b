"""Evaluation of the assays `fork` and `fork-mode`: effects of history and regime.

The assays evolve genomes further in four branches. The history of a branch is the origin of the
genomes: the learner, or the no-learning control. The regime is learning on or off in the branch.
All branches of a run have the same random numbers, so an effect is a difference within a run.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import xarray as xr

from baldwinlab.analysis.assays.evaluation import AssayEvaluation, EffectTable, QuantityValues

# Labels of the stored coordinates `history` and `regime`.
HISTORIES: Final = ("learner", "control")
REGIMES: Final = ("on", "off")
MEASURES: Final = {"innate_fitness": "innate fitness", "fitness": "fitness in the regime"}
LEARNING_OFF: Final = REGIMES[1]
QUANTITY_PREFIX: Final = "fork: "
EFFECTS: Final = ("history", "regime", "interaction")


def compute_effects(fork: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return effects (run, generation) by name, on means over agents at the end of the branches.

    - history: learner minus control, in the branches with learning off.
    - regime: learning on minus off, averaged over the histories.
    - interaction: the effect of the regime on the learner minus the effect on the control.
    """
    return {
        name_quantity(effect, measure): values
        for measure in MEASURES
        for effect, values in _compute_fork_effects(fork[measure].mean("agent")).items()
    }


def name_quantity(effect: str, measure: str) -> str:
    """Return the name of an effect on a measure in the tables of a report.

    >>> name_quantity("history", "innate_fitness")
    'fork: history, innate fitness'
    """
    return f"{QUANTITY_PREFIX}{effect}, {MEASURES[measure]}"


def _compute_fork_effects(fitness: xr.DataArray) -> dict[str, xr.DataArray]:
    """Return the effects (run, generation) on means (run, generation, history, regime)."""
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


def compute_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    for measure, effects in compute_effects(data).items():
        for generation in data["generation"].values.tolist():
            yield (measure, f"generation {generation}"), effects.sel(generation=generation)


def compute_mode_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    """Yield the effects of branches from copies of the most frequent genotype, the mode."""
    for (measure, start), values in compute_quantities(data, last):
        yield (measure, f"mode of {start}"), values


TABLE: Final = EffectTable(
    title="Further evolution with learning on and off",
    explanation=(
        "The fork assay evolves stored generations of the condition and of its no-learning control "
        "further, with learning on and with learning off. The effect of the history is the "
        "condition minus the control. The effect of the regime is learning on minus learning off. "
        "A history above 0 means that evolution with learning has led to better genomes. A regime "
        "below 0 means that learning now hides genetic differences, and above 0 that it guides "
        "selection."
    ),
    time="Start",
    columns=EFFECTS,
    measures={
        name: [name_quantity(effect, measure) for effect in EFFECTS]
        for measure, name in MEASURES.items()
    },
)
FORK: Final = AssayEvaluation(
    assay="fork",
    order=90,
    compute_quantities=compute_quantities,
    table=TABLE,
)
# There is no table, because the table of `fork` also has the rows of `fork-mode`.
FORK_MODE: Final = AssayEvaluation(
    assay="fork-mode", order=100, compute_quantities=compute_mode_quantities
)
