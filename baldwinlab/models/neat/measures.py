"""What models whose agents are networks that grow have in common: records of their shape, measures of a run's first solution.

First is meant in the order in which networks are made and tried.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.evolution.neat.genome import ENABLED, GENE, HEAD, NUMBER, SPECIES, TARGET
from baldwinlab.parts import OF_AGENT, Measure, Variable

SHAPE: Final[Mapping[str, Variable]] = {
    "hidden": Variable(OF_AGENT, np.int32, "nodes", "hidden nodes"),
    "enabled": Variable(OF_AGENT, np.int32, "links", "enabled links"),
    "species": Variable(
        OF_AGENT, np.int32, "", "number of the species, in the order in which they arose"
    ),
}

Solves = Callable[[xr.Dataset], xr.DataArray]  # from runs, whether each agent solves the task


def shape_of(graphs: npt.NDArray[np.float32]) -> Mapping[str, npt.NDArray[np.int32]]:
    """What `SHAPE` names, of genomes [run, agent, entry]."""
    genes = graphs[:, :, HEAD:].reshape(*graphs.shape[:2], -1, GENE)
    there = genes[..., NUMBER] > 0
    found = {
        "hidden": (there & (genes[..., NUMBER] == genes[..., TARGET])).sum(axis=-1),
        "enabled": (there & (genes[..., ENABLED] > 0)).sum(axis=-1),
        "species": graphs[:, :, SPECIES],
    }
    return {name: each.astype(np.int32) for name, each in found.items()}


def of_solutions(
    solves: Solves, recorded: Mapping[str, str] = MappingProxyType({})
) -> Mapping[str, Measure]:
    """Measures of a model whose agents are networks, by name; but for `solved`, NaN of a run without a solution.

    `recorded` says of further records what they mean, of the first solution.
    """

    def ever(runs: xr.Dataset) -> xr.DataArray:
        return solves(runs).any(("generation", "agent")) * 1.0

    def first(
        told: Callable[[xr.Dataset, npt.NDArray[np.intp]], npt.NDArray[Any]],
    ) -> Callable[[xr.Dataset], xr.DataArray]:
        """What is told of the place [run] that the first solution has among the networks of its run."""

        def of(runs: xr.Dataset) -> xr.DataArray:
            place = _in_order(solves(runs)).argmax(axis=1)
            return xr.DataArray(told(runs, place), {"run": runs["run"]}, "run").where(
                ever(runs) == 1
            )

        return of

    def of_record(name: str, meaning: str) -> Measure:
        return Measure(meaning, first(lambda runs, place: _at(runs[name], place)))

    return {
        "solved": Measure("1 if any network solves the task, else 0", ever),
        "generations": Measure(
            "generations to the first solution",
            first(lambda runs, place: place // runs.sizes["agent"] + 1),
        ),
        "evaluations": Measure(
            "networks evaluated to the first solution", first(lambda runs, place: place + 1)
        ),
        "hidden": of_record("hidden", "hidden nodes of the first solution"),
        "enabled": of_record("enabled", "enabled links of the first solution"),
        **{name: of_record(name, meaning) for name, meaning in recorded.items()},
    }


def _in_order(record: xr.DataArray) -> npt.NDArray[Any]:
    """Of every network [run, network], generation by generation."""
    return record.transpose("run", "generation", "agent").values.reshape(record.sizes["run"], -1)


def _at(record: xr.DataArray, place: npt.NDArray[np.intp]) -> npt.NDArray[Any]:
    """What is recorded of one network of each run, by its place."""
    found: npt.NDArray[Any] = _in_order(record)[np.arange(len(place)), place]
    return found
