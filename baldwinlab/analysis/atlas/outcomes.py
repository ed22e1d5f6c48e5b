"""Outcomes of a cell of the atlas: the same quantities for every model, one value per run.

| variable | dimensions | meaning |
|---|---|---|
| distance | run, generation | mean distance that learners learn |
| control_distance | run, generation | distance that genomes of the control learn if they can |
| neutral_distance | run, generation | the same without selection |
| innate_trait, control_innate_trait | run, generation | mean innate trait of learners, controls |
| selection_on, selection_off | run, generation | selection differentials of the innate trait |
| fitness, control_fitness | run, generation | mean fitness of the agents |
| founder_mean, founder_square | run | mean, and mean square, of the founders' innate trait |
| branch_innate_fitness | run, history, regime | mean innate fitness at the end of the fork |
| measure: NAME | run | a measure of the model |
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.assays.fork import compute_effects, name_quantity
from baldwinlab.analysis.estimands.quantitative_genetics import (
    compute_differentials,
    relative_difference,
)
from baldwinlab.analysis.estimands.traits import (
    INNATE_FITNESS,
    measure_log_fall,
    read_record,
    select_innate_trait,
)
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.measures import measure_runs

MEASURE_PREFIX: Final = "measure: "
# Number of measured generations in the first and in the last window.
N_WINDOW: Final = 3
# Smallest sum of selection differentials without learning, in SD. A smaller sum is rounding error.
MIN_SELECTION: Final = 1e-6
# Share of the final fall that ends the time t90.
PLATEAU_SHARE: Final = 0.9

# Variable of a cell with the learned distance, by history of the genomes.
DISTANCES: Final = {
    "learner": "distance",
    "control": "control_distance",
    "neutral": "neutral_distance",
}
OUTCOMES: Final = {
    "assimilation": "A: fall of the learned distance in learners minus that in the control",
    "learner_fall": "fall of the learned distance in learners: log(d_first / d_last)",
    "control_fall": "the same fall in genomes of the control, which are tested with learning",
    "neutral_fall": "the same fall in genomes that evolved without selection",
    "innate_response": "I: innate trait minus that of the control, in SD of the founders",
    "selection_ratio": "P: selection on the innate trait with learning, divided by that without",
    "t90": "generations until 90 % of the final fall of the learned distance",
    "fork_history": "fork: effect of the history of learning on innate fitness",
    "fork_regime": "fork: effect of learning now on innate fitness",
}
"""Meaning of each outcome."""


class CellData(NamedTuple):
    """The simulated data of a cell."""

    experiment: BaseExperiment
    # All generations with and without learning (run, generation, agent).
    learners: xr.Dataset
    controls: xr.Dataset
    innate: xr.Dataset  # The assay `innate` in the measured generations.
    assimilation: xr.Dataset  # The assay `assimilation` in these generations.
    fork: xr.Dataset


def reduce_cell(cell: CellData) -> xr.Dataset:
    """Return the variables of the table at the top of this module."""
    generations = cell.innate["generation"]
    learners, controls = (
        data.sel(generation=generations) for data in (cell.learners, cell.controls)
    )
    trait = select_innate_trait(cell.learners, cell.innate, cell.experiment)
    # Controls do not learn, so the fitness of a control is innate.
    control_trait = controls["energy"]
    model = cell.experiment.loaded_model
    if model is not None and trait.name != INNATE_FITNESS:
        control_trait = read_record(controls, model, model.innate_trait).values
    founders = trait.values.isel(generation=0)
    differentials = compute_differentials(cell.innate, trait.values, cell.experiment)
    values = {
        "innate_trait": trait.values.mean("agent"),
        "control_innate_trait": control_trait.mean("agent"),
        "selection_on": differentials["on"],
        "selection_off": differentials["off"],
        "fitness": learners["energy"].mean("agent"),
        "control_fitness": controls["energy"].mean("agent"),
        "founder_mean": founders.mean("agent"),
        "founder_square": (founders**2).mean("agent"),
        "branch_innate_fitness": cell.fork["innate_fitness"].isel(generation=0).mean("agent"),
    }
    distance = cell.assimilation["distance"]
    if bool(distance.notnull().any()) and not (model and model.assimilation_obstacle):
        values |= {name: distance.sel(history=key) for key, name in DISTANCES.items()}
    for name, measure in (cell.experiment.measures or {}).items():
        values[MEASURE_PREFIX + name] = measure_runs(measure.of, cell.learners)
    return xr.Dataset(
        {name: value.astype(np.float64).reset_coords(drop=True) for name, value in values.items()}
    )


def compute_outcomes(cell: xr.Dataset) -> xr.Dataset:
    """Return the variables of `OUTCOMES` (run), NaN where an outcome is not defined."""
    undefined = cell["founder_mean"] * np.nan
    last = {"generation": slice(-N_WINDOW, None)}  # Indices of measured generations.
    # Clonal founders do not vary within a run, so the variance includes differences between runs.
    variance = cell["founder_square"].mean("run") - cell["founder_mean"].mean("run") ** 2
    sd = variance.clip(min=0) ** 0.5
    difference = (cell["innate_trait"] - cell["control_innate_trait"]).isel(last).mean("generation")
    has_distance = "distance" in cell and cell.sizes["generation"] > 1  # A fall has two ends.
    falls = {
        history: _measure_fall(cell[name]) if has_distance else undefined
        for history, name in DISTANCES.items()
    }
    effects = compute_effects(_as_fork(cell))
    return xr.Dataset(
        {
            "assimilation": falls["learner"] - falls["control"],
            **{f"{history}_fall": fall for history, fall in falls.items()},
            "innate_response": difference / sd.where(sd > 0),
            "selection_ratio": _selection_ratio(cell),
            "t90": _time_to_plateau(cell["distance"]) if has_distance else undefined,
            "fork_history": effects[name_quantity("history", "innate_fitness")],
            "fork_regime": effects[name_quantity("regime", "innate_fitness")],
        }
    ).drop_attrs()


def _selection_ratio(cell: xr.Dataset) -> xr.DataArray:
    """Return the sum of S_on over the generations, divided by that of S_off (run)."""
    differentials = xr.Dataset({"on": cell["selection_on"], "off": cell["selection_off"]})
    is_selected = differentials["off"].sum("generation") > MIN_SELECTION
    # `relative_difference` is the ratio minus 1.
    return (relative_difference(differentials) + 1).where(is_selected)


def _as_fork(cell: xr.Dataset) -> xr.Dataset:
    """Return the branches as an assay `fork` of one agent with the mean of all agents."""
    # `compute_effects` also requires "fitness", but only the effects on innate fitness are used.
    innate_fitness = cell["branch_innate_fitness"].expand_dims("agent")
    return xr.Dataset({"innate_fitness": innate_fitness, "fitness": innate_fitness})


def _measure_fall(distance: xr.DataArray) -> xr.DataArray:
    """Return log(d_first / d_last) of each run."""
    # `measure_log_fall` also counts the generations between the measured generations.
    interval = int(distance["generation"][1] - distance["generation"][0])
    return measure_log_fall(distance, N_WINDOW * interval)


def _time_to_plateau(distance: xr.DataArray) -> xr.DataArray:
    """Return the first generation (run) with 90 % of the final fall. NaN without a fall."""
    first = distance.isel(generation=0)
    fall = first - distance.isel(generation=slice(-N_WINDOW, None)).mean("generation")
    has_fallen = (first - distance >= PLATEAU_SHARE * fall) & (fall > 0)
    generation = distance["generation"].isel(generation=has_fallen.argmax("generation"))
    return generation.where(fall > 0).reset_coords(drop=True)
