"""The kind of part that is a whole model: founders, lives, payoff; for models that are not the foragers of MiniWorld.

A model is chosen by `model = "its-name"`, and its fields stand in a table of its name. Population, evolution and record are
those of every experiment. Its genomes are float32 [agent, module, weight], so that selection, variation, records and assays are
those of all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.core.variables import Variable
from baldwinlab.parts.agent_parts import Part
from baldwinlab.parts.views import View


class FinalPopulation(NamedTuple):
    """Who lives at the end of a life in whose midst agents were born, in the place of each agent."""

    genome: npt.NDArray[np.float32]  # [run, agent, module, weight]
    origin: npt.NDArray[
        np.int32
    ]  # [run, agent, (fitter, other)], of which of the life's first newborns they descend


class LifeResults(NamedTuple):
    """What became of the agents of several runs in one generation."""

    energy: npt.NDArray[np.float64]  # [run, agent], gained in life
    cost: npt.NDArray[np.float64]  # [run, agent], of learning
    learned: (
        npt.NDArray[np.float32] | None
    )  # [run, agent, weight], the first module at death; None where it is no use
    records: Mapping[str, npt.NDArray[Any]]  # by name, [run, agent]: what else is recorded
    final_population: FinalPopulation | None = (
        None  # who lives at the end, where that is not who was born at the beginning
    )


class Measure(NamedTuple):
    """A number that sums up one run, which a paper's claims can be about."""

    meaning: str  # in words, with its unit
    of: Callable[
        [xr.Dataset], xr.DataArray
    ]  # from runs (run, generation, agent), as they are stored, to (run); NaN where there is none
    censored: Callable[[xr.Dataset], xr.DataArray] | None = (
        None  # of a time, by run: true where it lasts longer than that
    )


class Model(Part):
    """A kind of life."""

    kind: ClassVar[str] = "model"
    modules: ClassVar[tuple[str, ...]] = ("genome",)  # the names of a genome's modules
    infinite_genes: ClassVar[
        tuple[int, ...]
    ] = ()  # by number in a module: those that may be infinite; no others may
    records: ClassVar[
        Mapping[str, Variable]
    ] = {}  # what is recorded of every agent and generation beside fitness
    defaults: ClassVar[
        Mapping[str, Mapping[str, Any]]
    ] = {}  # of fields, by table: population, evolution, record
    check_settings: ClassVar[
        Mapping[str, Any]
    ] = {}  # fields of its own: lives so short that plain Python lives them in seconds
    measures: ClassVar[
        Mapping[str, Measure]
    ] = {}  # by name: what sums up a run, beside best, mean and share
    shares: ClassVar[
        Mapping[str, Measure]
    ] = {}  # by name: what is drawn beside records that are shares; to (..., generation)
    alleles: ClassVar[
        Mapping[str, float]
    ] = {}  # by name, in the order of drawing: what stands for it in a genome
    views: ClassVar[
        Mapping[str, View]
    ] = {}  # by name: how a generation can be looked at, beside its alleles
    clock: ClassVar[str] = (
        ""  # which of the records counts how often an agent asked its world: evaluations, as generations are
    )
    payoff: ClassVar[str] = "fitness"  # what it is called that lives gain, in words

    @property
    def learns(self) -> bool:
        """Whether agents learn in life."""
        return False

    @property
    def steps(self) -> int:
        """Steps of a life: what rates and times left are told in."""
        return 1

    def all_shares(self) -> dict[str, Measure]:
        """What generations are made of: the records that are shares, mean over agents, and its own `shares`."""
        recorded = {
            name: Measure(one.meaning, _mean_of(name))
            for name, one in self.records.items()
            if one.unit == "1"
        }
        return recorded | dict(self.shares)

    def without_learning(self) -> Self:
        """The same with nothing learned in life: what is gained then is innate. Raises ValueError where that is no life."""
        raise ValueError(f"the model {self.name!r} says nothing of a life without learning")

    def weights(self) -> int:
        """Entries of a module."""
        raise NotImplementedError

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        """The genomes [agent, module, weight] of a generation without parents; random numbers are `key.uniforms(...)`."""
        raise NotImplementedError

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        """The lives of one generation of these runs; `genomes` is [run, agent, module, weight]. A run's bits are its own."""
        raise NotImplementedError


def _mean_of(name: str) -> Callable[[xr.Dataset], xr.DataArray]:
    return lambda runs: runs[name].mean("agent")
