"""Records and measures of all models in which the topology of networks evolves.

The first solution of a run is the first network that solves the task, in the order of evaluation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.evolution.neat.genome import (
    ENABLED,
    GENE_SIZE,
    HEAD_SIZE,
    INNOVATION,
    SPECIES,
    TARGET,
)
from baldwinlab.parts import Measure, Variable

NETWORK_RECORDS: Final[Mapping[str, Variable]] = {
    "hidden": Variable.integer("nodes", "hidden nodes"),
    "enabled": Variable.integer("links", "enabled links"),
    "species": Variable.integer("", "number of the species, in the order in which they arose"),
}

# Function that returns for each agent of the runs whether it solves the task.
Solves = Callable[["xr.Dataset"], "xr.DataArray"]


def record_networks(graphs: npt.NDArray[np.float32]) -> Mapping[str, npt.NDArray[np.int32]]:
    """Return the records of `NETWORK_RECORDS` for genomes [run, agent, entry]."""
    genes = graphs[:, :, HEAD_SIZE:].reshape(*graphs.shape[:2], -1, GENE_SIZE)
    exists = genes[..., INNOVATION] > 0
    records = {
        "hidden": (exists & (genes[..., INNOVATION] == genes[..., TARGET])).sum(axis=-1),
        "enabled": (exists & (genes[..., ENABLED] > 0)).sum(axis=-1),
        "species": graphs[:, :, SPECIES],
    }
    return {name: values.astype(np.int32) for name, values in records.items()}


def measure_solutions(
    solves: Solves, recorded: Mapping[str, str] = MappingProxyType({})
) -> Mapping[str, Measure]:
    """Return the measures of a model whose agents are networks, by name.

    Except for `solved`, measures are NaN for runs without a solution.
    """

    def is_solved(runs: xr.Dataset) -> xr.DataArray:
        return solves(runs).any(("generation", "agent")) * 1.0

    def measure_first_solution(
        quantity: Callable[[xr.Dataset, npt.NDArray[np.intp]], npt.NDArray[Any]],
    ) -> Callable[[xr.Dataset], xr.DataArray]:
        """Measure a quantity of the first solution by its position in the order of evaluation."""

        def measure(runs: xr.Dataset) -> xr.DataArray:
            positions = _order_by_evaluation(solves(runs)).argmax(axis=1)
            values = xr.DataArray(quantity(runs, positions), {"run": runs["run"]}, "run")
            return values.where(is_solved(runs) == 1)

        return measure

    def measure_record(name: str, meaning: str) -> Measure:
        return Measure(
            meaning,
            measure_first_solution(lambda runs, positions: _values_at(runs[name], positions)),
        )

    return {
        "solved": Measure("1 if any network solves the task, else 0", is_solved),
        "generations": Measure(
            "generations to the first solution",
            measure_first_solution(lambda runs, positions: positions // runs.sizes["agent"] + 1),
        ),
        "evaluations": Measure(
            "networks evaluated to the first solution",
            measure_first_solution(lambda runs, positions: positions + 1),
        ),
        "hidden": measure_record("hidden", "hidden nodes of the first solution"),
        "enabled": measure_record("enabled", "enabled links of the first solution"),
        **{name: measure_record(name, meaning) for name, meaning in recorded.items()},
    }


def _order_by_evaluation(record: xr.DataArray) -> npt.NDArray[Any]:
    """Return a record as [run, network], ordered by generation, then by agent."""
    return record.transpose("run", "generation", "agent").values.reshape(record.sizes["run"], -1)


def _values_at(record: xr.DataArray, positions: npt.NDArray[np.intp]) -> npt.NDArray[Any]:
    """Return the values of a record for one network of each run, at `positions` [run]."""
    values: npt.NDArray[Any] = _order_by_evaluation(record)[np.arange(len(positions)), positions]
    return values
