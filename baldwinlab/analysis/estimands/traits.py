"""Traits of a model, and measures of the learning that evolution has made unnecessary.

A trait is an innate trait under selection, or the distance that learning covers. Assimilation is
the fall of this distance, beyond the fall in genomes that evolved without learning. Savings [3]_
are the fall of the learning time, which ends at 90 % of an agent's final performance. Both falls
are logarithms of a ratio.

References
----------
.. [1] C. H. Waddington, "Genetic assimilation of an acquired character", Evolution 7 (1953).
.. [2] G. E. Hinton and S. J. Nowlan, "How learning can guide evolution", Complex Systems 1 (1987).
.. [3] H. Ebbinghaus, "Über das Gedächtnis" (1885).
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.assays.evaluation import RANDOM_NEWBORNS, parse_generation
from baldwinlab.analysis.statistics.comparisons import log_ratio
from baldwinlab.core.variables import GENERATION_COUNT
from baldwinlab.experiment import BaseExperiment

INNATE_FITNESS: Final = "innate fitness"
FINAL_SHARE: Final = 0.9  # Fraction of the final performance that ends the learning time.


class Trait(NamedTuple):
    """A trait of a condition."""

    name: str  # Meaning of the trait.
    unit: str
    # (run, generation, agent) for an innate trait, (run, generation) for a distance.
    values: xr.DataArray


def select_innate_trait(data: xr.Dataset, innate: xr.Dataset, experiment: BaseExperiment) -> Trait:
    """Return the innate trait on which selection is measured.

    The trait is the recorded variable `innate_trait` of the model. Without this declaration, it is
    innate fitness. The values have the runs and generations of the assay `innate`.
    """
    model = experiment.loaded_model
    name = model.innate_trait if model is not None else ""
    if model is None or name not in data:
        fitness = innate["energy"].sel(life="off", drop=True)
        return Trait(INNATE_FITNESS, "fitness", fitness)
    return read_record(_select_assayed(data, innate), model, name)


def describe_learned_distance(experiment: BaseExperiment) -> str:
    """Return the meaning of the distance that the assay `assimilation` measures."""
    model = experiment.loaded_model
    name = model.learned_distance if model is not None else ""
    if model is None or not name:
        return "distance of the weights between birth and death"
    variable = model.shares.get(name) or model.records[name]
    return str(variable.meaning)


def read_record(runs: xr.Dataset, model: Any, name: str) -> Trait:
    """Return a recorded variable of a model, with its meaning and its unit."""
    variable = model.records[name]
    return Trait(variable.meaning, variable.unit, runs[name].astype(np.float64))


def _select_assayed(data: xr.Dataset, innate: xr.Dataset) -> xr.Dataset:
    """Return the data of the runs and generations of the assay.

    As in the assay, a run that stopped early repeats its last simulated generation.
    """
    runs = data.sel(run=innate["run"])
    if GENERATION_COUNT not in runs.coords:
        return runs.sel(generation=innate["generation"])
    generation = np.minimum(innate["generation"], runs[GENERATION_COUNT] - 1)
    return runs.sel(generation=generation).assign_coords(generation=innate["generation"])


def split_ends(values: xr.DataArray, last: int) -> tuple[xr.DataArray, xr.DataArray]:
    """Return the values in the first `last` and in the last `last` generations.

    A window has at most half of the generations, so that the windows do not overlap. Generations
    without values count, too.
    """
    generation = values["generation"].astype(np.int64)
    n_generations = int(generation.max() - generation.min()) + 1
    length = max(1, min(last, n_generations // 2))
    first = values.where(generation < generation.min() + length, drop=True)
    return first, values.where(generation > generation.max() - length, drop=True)


def measure_log_fall(values: xr.DataArray, last: int) -> xr.DataArray:
    """Return log(first / last), with the mean values in the first and in the last generations.

    The result has no dimension `generation`. 0 means no change, above 0 a fall, and below 0 a rise.
    See `log_ratio` for a value of 0 in the last generations. The result is NaN if the value in the
    first generations is 0.
    """
    first, final = (window.mean("generation") for window in split_ends(values, last))
    return first.copy(data=log_ratio(first.where(first > 0).values, final.values))


def find_learning_time(performance: xr.DataArray, ends: xr.DataArray) -> xr.DataArray:
    """Return the end of the first window of life with 90 % of the last window's performance.

    `performance` (..., window) is, for example, the items eaten per step. `ends` (window) are the
    steps at which windows end. The result is NaN if the last performance is not above 0.
    """
    final = performance.isel(window=-1)
    is_reached = performance >= FINAL_SHARE * final
    first_window = is_reached.argmax("window")  # Index of the first True.
    return ends.isel(window=first_window).drop_vars("window", errors="ignore").where(final > 0)


def measure_foraging_times(within_life: xr.Dataset, steps: int) -> xr.DataArray:
    """Return the learning time of the average agent (run, generation), in steps."""
    names = [str(name) for name in within_life["newborns"].values if name != RANDOM_NEWBORNS]
    eaten = within_life["eaten_in_window"].sel(newborns=names).mean("agent")
    starts = eaten["window"].values
    # The last window may be shorter than the others.
    ends = xr.DataArray(np.append(starts[1:], steps), dims="window")
    times = find_learning_time(eaten / (ends - starts), ends)
    generations = [parse_generation(name) for name in names]
    return times.rename(newborns="generation").assign_coords(generation=generations)
