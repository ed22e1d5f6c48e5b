"""Base class, records and measures of all models in which the topology of networks evolves.

The first solution of a run is the first network that solves the task, in the order of evaluation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.evolution.neat.genome import (
    ENABLED,
    GENE_SIZE,
    HEAD_SIZE,
    INFINITE_GENES,
    INNOVATION,
    SPECIES,
    TARGET,
    count_entries,
    make_minimal_graphs,
    require_neat,
)
from baldwinlab.models import kit
from baldwinlab.parts import Field, Measure, Model, Variable

NETWORK_RECORDS: Final[Mapping[str, Variable]] = {
    "hidden": Variable.integer("nodes", "hidden nodes"),
    "enabled": Variable.integer("links", "enabled links"),
    "species": Variable.integer("", "number of the species, in the order in which they arose"),
}

N_OUTPUTS: Final = 1
FOUNDER_WEIGHT_RANGE: Any = Field(
    1.0,
    ge=0,
    le=1000,
    description="Limit R of the founders' weights, drawn from U(-R, R) (our choice).",
)

# Function that returns for each agent of the runs whether it solves the task.
Solves = Callable[["xr.Dataset"], "xr.DataArray"]


class NetworkModel(Model):
    """Base class of the models in which the topology of networks with one output evolves."""

    if TYPE_CHECKING:
        # Each model declares its settings, because their order is that of its documentation.
        max_links: int
        founder_weight_range: float

    has_graph_genomes = True
    infinite_genes = INFINITE_GENES
    # Number of inputs without the bias.
    n_inputs: ClassVar[int]

    def without_learning(self) -> Self:
        return self

    def check(self, experiment: Any) -> None:
        require_neat(experiment, f"model = {self.name!r}")

    def n_weights(self) -> int:
        return count_entries(self.max_links)

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        # The bias is an input.
        n_sources = self.n_inputs + 1
        draws = kit.draw_founder_numbers(key, agents, n_sources)[:, 0]
        weights = (2 * draws - 1) * self.founder_weight_range
        graphs = make_minimal_graphs(n_sources, N_OUTPUTS, self.max_links, weights)
        # A genome has one module.
        return graphs[:, None]


def record_networks(graphs: kit.Genomes) -> Mapping[str, npt.NDArray[Any]]:
    """Return the records of `NETWORK_RECORDS` for genomes [run, agent, entry]."""
    genes = graphs[:, :, HEAD_SIZE:].reshape(*graphs.shape[:2], -1, GENE_SIZE)
    exists = genes[..., INNOVATION] > 0
    return {
        "hidden": (exists & (genes[..., INNOVATION] == genes[..., TARGET])).sum(axis=-1),
        "enabled": (exists & (genes[..., ENABLED] > 0)).sum(axis=-1),
        "species": graphs[:, :, SPECIES],
    }


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
        def read_values(runs: xr.Dataset, positions: npt.NDArray[np.intp]) -> npt.NDArray[Any]:
            values: npt.NDArray[Any] = _order_by_evaluation(runs[name])
            return values[np.arange(len(positions)), positions]

        return Measure(meaning, measure_first_solution(read_values))

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
