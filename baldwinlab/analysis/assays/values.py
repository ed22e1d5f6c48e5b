"""Types and functions that the evaluations of all assays share.

A quantity of an assay has one value per run: an average over the agents and, if the assay has
generations, over a window of generations. Fitness is the variable `energy`: for MiniWorld, the
energy of the items that an agent eats.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import xarray as xr

from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.toml import from_toml

# Datasets of one assay by condition, and of all assays: `assays["innate"]["evo/A"]`.
Stored = Mapping[str, xr.Dataset]
Assays = Mapping[str, Stored]
# A measure, and the time or the agents: ("off", "last") or ("first meal", "evolved").
Quantity = tuple[str, str]
# Label of newborns with random genomes on the coordinate `newborns`.
RANDOM_NEWBORNS: Final = "random genome"


def parse_experiments(assays: Assays) -> dict[str, Experiment]:
    """Return the experiment of every condition with a stored assay, by condition."""
    datasets = {name: data for stored in assays.values() for name, data in stored.items()}
    return {
        name: from_toml(data.attrs["experiment"], source=f"the experiment of {name}", lenient=True)
        for name, data in datasets.items()
    }


def read_factors(data: xr.Dataset) -> Factors:
    """Return the factors of the condition of an assay, from the attributes of `read_assays`."""
    return Factors(*(data.attrs[name] for name in Factors._fields))


def weight_distances(innate: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return mean distances over agents (run, generation) between the weights at birth and death.

    The key "distance" is for all weights, and "distance, LAYER" for a layer. The dictionary is
    empty if the model has no weights.
    """
    if "distance" not in innate:
        return {}
    distance = innate["distance"]
    # The layers are parts of one vector, so the squares add up. Without a value, the sum is NaN.
    total_distance = (distance**2).sum("layer", min_count=1) ** 0.5
    layer_distances = {
        f"distance, {layer}": distance.sel(layer=layer).mean("agent")
        for layer in distance["layer"].values
    }
    return {"distance": total_distance.mean("agent"), **layer_distances}


def drop_labels(values: xr.DataArray) -> xr.DataArray:
    """Return values (run) with only the coordinate `run`. `xr.align` needs this coordinate."""
    return values.drop_vars(set(values.coords) - {"run"})


def compute_share(part: xr.DataArray, total: xr.DataArray) -> xr.DataArray:
    """Return part / total, or NaN if the total is not above 0."""
    return part / total.where(total > 0)


def parse_generation(newborns: str) -> int:
    """Return the generation at the end of a name of newborns: "generation 99" -> 99."""
    return int(newborns.split()[-1])


def find_learning_conditions(
    assays: Assays, experiments: Mapping[str, BaseExperiment]
) -> list[str]:
    """Return the conditions that evolve and learn, among the experiments of stored assays."""
    # Assays compare only a condition that evolves and learns with a control.
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

    For a model other than MiniWorld, the stored assay `innate` decides, because the model may not
    be loaded. Without learning, the fitness with learning on is NaN.
    """
    if experiment.evolution.inheritance == "none":
        return False
    if isinstance(experiment, Experiment):
        return experiment.learns
    return innate is not None and bool(innate["energy"].sel(life="on").notnull().any())
