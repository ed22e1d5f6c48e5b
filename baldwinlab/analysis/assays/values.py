"""Values of the stored assays, with one value per run.

The value of a run is an
average over its agents and, if the assay has generations, over its first or last generations.
Fitness is the variable `energy`: for MiniWorld, the energy of the items that an agent eats.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import xarray as xr

from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.toml import from_toml

# Datasets of an assay by condition, and of all assays by name.
Stored = Mapping[str, xr.Dataset]
Assays = Mapping[str, Stored]
# A measure with its time or its agents, such as ("off", "last") or ("first meal", "evolved").
Quantity = tuple[str, str]
# The stored name of newborns with random genomes.
RANDOM_NEWBORNS: Final = "random genome"


def parse_experiments(assays: Assays) -> dict[str, Experiment]:
    """Return the experiment of every condition with a stored assay."""
    datasets = {name: data for stored in assays.values() for name, data in stored.items()}
    return {
        name: from_toml(data.attrs["experiment"], source=f"the experiment of {name}", lenient=True)
        for name, data in datasets.items()
    }


def read_factors(data: xr.Dataset) -> Factors:
    """Return the factors of the condition of an assay."""
    return Factors(*(data.attrs[name] for name in Factors._fields))


def weight_distances(innate: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return the distance between the weights at birth and at death.

    Returns means over agents (run, generation), for all weights and for each layer. Empty if the
    model has no weights.
    """
    if "distance" not in innate:
        return {}
    distance = innate["distance"]
    # The layers are parts of one vector of weights.
    total_distance = (distance**2).sum("layer", min_count=1) ** 0.5
    layer_distances = {
        f"distance, {layer}": distance.sel(layer=layer).mean("agent")
        for layer in distance["layer"].values
    }
    return {"distance": total_distance.mean("agent"), **layer_distances}


def drop_labels(values: xr.DataArray) -> xr.DataArray:
    """Return values (run) without coordinates other than `run`, which `xr.align` requires."""
    return values.drop_vars(set(values.coords) - {"run"})


def compute_share(part: xr.DataArray, total: xr.DataArray) -> xr.DataArray:
    """Return part / total, or NaN if the total is 0."""
    return part / total.where(total > 0)


def parse_generation(newborns: str) -> int:
    """Return the generation at the end of a name of newborns."""
    return int(newborns.split()[-1])


def find_learning_conditions(
    assays: Assays, experiments: Mapping[str, BaseExperiment]
) -> list[str]:
    """Return the conditions that evolve and learn, among the experiments of stored assays."""
    # Only a condition that evolves and learns is compared with its control.
    compared = {
        name
        for stored in assays.values()
        for name, data in stored.items()
        if "control_experiment" in data.attrs
    }
    innate = assays.get("innate", {})
    return [
        name
        for name, experiment in experiments.items()
        if name in compared or evolves_and_learns(experiment, innate.get(name))
    ]


def evolves_and_learns(experiment: BaseExperiment, innate: xr.Dataset | None) -> bool:
    """Return whether a condition evolves and learns.

    A model other than MiniWorld may not be loaded. Then the stored assay `innate` shows whether the
    condition learns.
    """
    if experiment.evolution.inheritance == "none":
        return False
    if isinstance(experiment, Experiment):
        return experiment.learns
    return innate is not None and bool(innate["energy"].sel(life="on").notnull().any())
