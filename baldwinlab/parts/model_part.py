"""The kind of part that is a complete model: founders, lifetimes and payoffs.

Genomes are float32 [agent, module, weight]. Selection, variation, records and assays work with all
models.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.variables import Variable
from baldwinlab.experiment.measures import Measure
from baldwinlab.parts.part import Part
from baldwinlab.parts.views import View


class FinalPopulation(NamedTuple):
    """Population at the end of a lifetime with births."""

    # Genomes of the agents that are alive, [run, agent, module, weight].
    genome: npt.NDArray[np.float32]
    # Indices of the two agents at the beginning of the lifetime from which an agent descends,
    # [run, agent, 2].
    origin: npt.NDArray[np.int32]


class LifeResults(NamedTuple):
    """Results of one lifetime of several runs.

    Attributes
    ----------
    energy : array, float64 [run, agent]
        Energy gained, or payoff.
    cost : array, float64 [run, agent]
        Cost of learning.
    learned : array, float32 [run, agent, weight], or None
        Weights of the first module at death. None if these weights are not needed.
    records : Mapping[str, array]
        Further recorded variables by name, each [run, agent].
    final_population : FinalPopulation or None
        Agents at the end of the lifetime, if agents were born during it.
    eaten : array, int32 [run, agent, region], or None
        Eaten items of each region. None without a world.
    position : array, float32 [run, agent, 2], or None
        Position at the end, x and y. None without a world.
    lifetimes : tuple of LifeResults
        Results of each lifetime, if agents have several lifetimes. `energy`, `cost` and `records`
        are then means, `eaten` is a sum, and the other fields are those of the first lifetime.
    """

    energy: npt.NDArray[np.float64]
    cost: npt.NDArray[np.float64]
    learned: npt.NDArray[np.float32] | None
    records: Mapping[str, npt.NDArray[Any]]
    final_population: FinalPopulation | None = None
    eaten: npt.NDArray[np.int32] | None = None
    position: npt.NDArray[np.float32] | None = None
    lifetimes: tuple[LifeResults, ...] = ()


class Model(Part):
    """Model: founders, lifetimes and payoffs that replace those of MiniWorld.

    `model = "NAME"` chooses a model. The settings of the model are in a table with its name. The
    tables population, evolution and record are the same for all models.

    Attributes
    ----------
    modules : tuple of str
        Names of the modules of a genome.
    has_graph_genomes : bool
        True if a genome is a graph with a variable number of genes, as in NEAT.
    infinite_genes : tuple of int
        Indices in a module of the genes that may be infinite. All other genes must be finite.
    records : Mapping[str, Variable]
        Recorded variables of every agent and generation, in addition to fitness.
    defaults : Mapping[str, Mapping[str, Any]]
        Default settings by table: population, evolution, record.
    check_settings : Mapping[str, Any]
        Settings of the model for `baldwinlab check`, with which plain Python simulates a lifetime
        in seconds.
    measures : Mapping[str, Measure]
        Measures of a run, by name.
    shares : Mapping[str, Measure]
        Measures that figures show as curves, in addition to the records with the unit "1".
    alleles : Mapping[str, float]
        Value of each allele in a genome, by name, in the order of drawing.
    views : Mapping[str, View]
        Views of a generation for the lab, by name.
    clock : str
        Name of the record with the number of evaluations of an agent, or "".
    payoff : str
        Name of the payoff, in figures and reports.
    innate_trait : str
        Name of the record with a trait at birth on which selection acts, or "" for innate fitness.
    learned_distance : str
        Name of the record, or of the entry of `shares`, with the distance between an agent at birth
        and the goal of learning. "" for the distance between the weights at birth and at death.
    learning_time : str
        Name of the record with the number of steps or trials until an agent has learned, or "".
    learning_amount : str
        Name of the setting with the learning rate, the step or the number of trials, or "".
    lifetime_steps : str
        Name of the setting with the number of steps of a lifetime, or "" for one step.
    assimilation_obstacle : str
        Sentence that states why learned behavior cannot become innate, or "".
    settings_without_learning : Mapping[str, Any]
        Values of settings with which agents do not learn, for example `{"trials": 0}`. Empty for a
        model without learning, and for a model that overrides `learns` and `without_learning`.
    """

    kind: ClassVar[str] = "model"
    modules: ClassVar[tuple[str, ...]] = ("genome",)
    has_graph_genomes: ClassVar[bool] = False
    infinite_genes: ClassVar[tuple[int, ...]] = ()
    records: ClassVar[Mapping[str, Variable]] = {}
    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    check_settings: ClassVar[Mapping[str, Any]] = {}
    measures: ClassVar[Mapping[str, Measure]] = {}
    shares: ClassVar[Mapping[str, Measure]] = {}
    alleles: ClassVar[Mapping[str, float]] = {}
    views: ClassVar[Mapping[str, View]] = {}
    clock: ClassVar[str] = ""
    payoff: ClassVar[str] = "fitness"
    innate_trait: ClassVar[str] = ""
    learned_distance: ClassVar[str] = ""
    learning_time: ClassVar[str] = ""
    learning_amount: ClassVar[str] = ""
    lifetime_steps: ClassVar[str] = ""
    assimilation_obstacle: ClassVar[str] = ""
    settings_without_learning: ClassVar[Mapping[str, Any]] = {}

    @property
    def learns(self) -> bool:
        """Whether agents learn: whether a setting differs from `settings_without_learning`."""
        return any(
            getattr(self, name) != value for name, value in self.settings_without_learning.items()
        )

    @property
    def steps(self) -> int:
        """Number of steps of a lifetime, at least 1."""
        return max(1, getattr(self, self.lifetime_steps)) if self.lifetime_steps else 1

    def all_shares(self) -> dict[str, Measure]:
        """Return `shares`, and the mean over agents of each record with the unit "1"."""
        recorded_shares = {
            name: Measure(variable.meaning, _mean_of(name))
            for name, variable in self.records.items()
            if variable.unit == "1"
        }
        return recorded_shares | dict(self.shares)

    def all_measures(self) -> dict[str, Measure]:
        """Return `measures`, and measures that depend on the settings of the model."""
        return dict(self.measures)

    def without_learning(self) -> Self:
        """Return the same model without learning.

        Raises
        ------
        ValueError
            If the model has no lifetime without learning.
        """
        if not self.settings_without_learning:
            raise ValueError(f"the model {self.name!r} has no lifetime without learning")
        return self.model_copy(update=dict(self.settings_without_learning))

    def n_weights(self) -> int:
        """Return the number of entries of a module."""
        raise NotImplementedError

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        """Return the genomes of the first generation.

        Parameters
        ----------
        agents : int
            Number of agents.
        key : GenerationKey
            Key of the random numbers. `key.uniforms(...)` draws them.

        Returns
        -------
        array, float32 [agent, module, weight]
            Genomes.
        """
        raise NotImplementedError

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        """Simulate one lifetime of all agents of several runs.

        The results of a run must not depend on the other runs.

        Parameters
        ----------
        seed : int
            Seed of the study.
        runs : sequence of int
            Indices of the runs. Seed, run and generation are the key of the random numbers.
        generation : int
            Generation, from 0.
        genomes : array, float32 [run, agent, module, weight]
            Genomes at birth. Read only.

        Returns
        -------
        LifeResults
            Payoff, cost of learning, learned weights and records of all agents.
        """
        raise NotImplementedError

    def make_results(
        self,
        energy: npt.NDArray[np.float64],
        records: Mapping[str, Any],
        *,
        cost: npt.NDArray[np.float64] | None = None,
        learned: npt.NDArray[Any] | None = None,
    ) -> LifeResults:
        """Return the results of lifetimes, with copies of the records in their declared types.

        Parameters
        ----------
        energy : array, float64 [run, agent]
            Energy gained, or payoff.
        records : Mapping[str, array]
            Recorded variables by name, each [run, agent].
        cost : array, float64 [run, agent], optional
            Cost of learning. 0 by default.
        learned : array [run, agent, weight], optional
            Weights of the first module at death, if they are needed.

        Returns
        -------
        LifeResults
            The results.
        """
        return LifeResults(
            energy=energy,
            cost=np.zeros_like(energy) if cost is None else cost,
            learned=None if learned is None else learned.astype(np.float32, copy=False),
            records={
                name: np.array(values, self.records[name].dtype) for name, values in records.items()
            },
        )


def _mean_of(name: str) -> Callable[[xr.Dataset], xr.DataArray]:
    return lambda runs: runs[name].mean("agent")
