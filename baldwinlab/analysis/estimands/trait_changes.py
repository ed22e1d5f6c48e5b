"""Changes of the innate trait of a condition: their parts, and their prediction from heritability.

References
----------
.. [1] G. R. Price, "Selection and covariance", Nature 227 (1970).
.. [2] D. S. Falconer and T. F. C. Mackay, "Introduction to quantitative genetics", 4th edition
   (1996).
.. [3] G. Mayley, "Landscapes, learning costs, and genetic assimilation", Evolutionary Computation 4
   (1996).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.estimands.expected_offspring import SCHEMES, expect_offspring
from baldwinlab.analysis.estimands.price_partition import PARTS, partition_change
from baldwinlab.analysis.estimands.quantitative_genetics import (
    correlate_distances,
    estimate_heritability,
)
from baldwinlab.analysis.estimands.traits import Trait, read_record, select_innate_trait
from baldwinlab.experiment import BaseExperiment

RESIDUAL: Final = "identity residual"
CORRELATION: Final = "genotype-phenotype correlation"
GENETICS: Final = ("heritability", "additive variance", "predicted response", "response")
# Limit of the number of agents in a correlation of distances, whose time is its square.
MAX_AGENTS: Final = 300


class TraitChanges(NamedTuple):
    """Changes of the mean of an innate trait.

    Attributes
    ----------
    trait, unit : str
        Meaning and unit of the trait.
    values : xr.Dataset
        "change", the parts of `PARTS`, "identity residual" and the quantities of `GENETICS` (run,
        generation), and "genotype-phenotype correlation" (run).
    """

    trait: str
    unit: str
    values: xr.Dataset


def find_obstacle(experiment: BaseExperiment) -> str:
    """Return why the changes of a condition cannot be partitioned, as a sentence, or ""."""
    selection = experiment.evolution.selection
    if experiment.population.species:
        return "The agents of a generation belong to several species."
    if experiment.may_stop:
        return "A run can end before its last generation."
    if selection not in SCHEMES:
        return f"The expected number of offspring under the selection {selection} is not known."
    return ""


def measure_changes(
    runs: xr.Dataset,
    innate: xr.Dataset,
    experiment: BaseExperiment,
    genotypes: xr.DataArray | None = None,
) -> TraitChanges:
    """Partition the changes of the innate trait, and predict them from its heritability.

    `find_obstacle` returns "" for the experiment. The genotypes are genomes (run, agent, gene) with
    the coordinate `generation`, and the phenotype of the correlation is the fitness with learning.
    The values have no generation if no two successive generations have the trait. See Price 1970;
    Falconer and Mackay 1996; Mayley 1996.
    """
    runs = runs.sel(run=innate["run"])
    trait = _select_trait(runs, innate, experiment)
    offspring = {
        life: expect_offspring(innate["energy"].sel(life=life, drop=True), experiment)
        for life in ("off", "on")
    }
    partition = partition_change(trait.values, runs["parents"], offspring["off"], offspring["on"])
    residual = sum(partition[name] for name in PARTS) - partition["change"]
    genetics = estimate_heritability(trait.values, runs["parents"])[list(GENETICS)]
    values = partition.assign({RESIDUAL: residual}).merge(genetics, join="outer", compat="override")
    correlation = xr.full_like(runs["run"], np.nan, dtype=np.float64)
    if genotypes is not None:
        fitness = innate["energy"].sel(life="on", generation=genotypes["generation"], drop=True)
        correlation = _correlate(genotypes.drop_vars("generation"), fitness)
    return TraitChanges(trait.name, trait.unit, values.assign({CORRELATION: correlation}))


def average_changes(changes: TraitChanges) -> dict[str, xr.DataArray]:
    """Return the mean of each quantity over generations (run), and the largest residual."""
    averages = {
        str(name): values.mean("generation") if "generation" in values.dims else values
        for name, values in changes.values.items()
    }
    averages[RESIDUAL] = abs(changes.values[RESIDUAL]).max("generation")
    return averages


def _select_trait(runs: xr.Dataset, innate: xr.Dataset, experiment: BaseExperiment) -> Trait:
    """Return the innate trait, in all generations if the model records it."""
    model = experiment.loaded_model
    if model is not None and model.innate_trait in runs:
        return read_record(runs, model, model.innate_trait)
    return select_innate_trait(runs, innate, experiment)


def _correlate(genotypes: xr.DataArray, fitness: xr.DataArray) -> xr.DataArray:
    """Return `correlate_distances` for agents at equal distances in their order (run)."""
    n_agents = genotypes.sizes["agent"]
    numbers = np.unique(np.linspace(0, n_agents - 1, min(n_agents, MAX_AGENTS)).astype(int))
    phenotypes = fitness.expand_dims("feature", axis=-1)
    return correlate_distances(genotypes.isel(agent=numbers), phenotypes.isel(agent=numbers))
