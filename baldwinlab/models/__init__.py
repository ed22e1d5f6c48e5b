"""Models, and simulators that compute the lifetimes of agents of several runs.

`baldwinlab/simulation` calls `make_simulator`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from baldwinlab.evolution.genes import trim_genomes
from baldwinlab.evolution.species import derive_seed
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.model_part import LifeResults


class Simulator(Protocol):
    """Simulator of several runs. The results of a run do not depend on the other runs."""

    def simulate(
        self, generation: int, genomes: npt.NDArray[np.float32], *sizes: Any
    ) -> LifeResults:
        """Return the results of a generation.

        `genomes` [run, agent, module, weight]: genomes at birth. `*sizes`: one array [run, species]
        with the number of agents of each species, or nothing for an experiment without species.
        """
        ...


class _ModelSimulator:
    """Simulator of one model for all agents. The model is any model except MiniWorld."""

    def __init__(self, experiment: BaseExperiment, seed: int, runs: Sequence[int]) -> None:
        self._model = experiment.model_part
        # Genomes can have further genes, which belong to other parts and not to the model.
        self._n_weights = experiment.weight_count
        self._seed = seed
        self._runs = runs

    def simulate(self, generation: int, genomes: npt.NDArray[np.float32]) -> LifeResults:
        weights = np.ascontiguousarray(genomes[..., : self._n_weights])
        results: LifeResults = self._model.simulate(self._seed, self._runs, generation, weights)
        return results


class SpeciesModelSimulator:
    """Simulate each species by its model. Different species do not interact in a lifetime."""

    def __init__(self, experiment: BaseExperiment, seed: int, runs: Sequence[int]) -> None:
        self._members = experiment.species_experiments()
        self._seed = seed
        self._runs = runs

    def simulate(
        self, generation: int, genomes: npt.NDArray[np.float32], sizes: npt.NDArray[np.int64]
    ) -> LifeResults:
        """Return the results of a generation.

        `genomes` [run, agent, module, weight]: genomes at birth, all agents of species 0 first,
        then those of species 1 and so on. `sizes` [run, species]: number of agents of each species.
        """
        n_runs, n_agents, _, n_weights = genomes.shape
        collected = _Results(n_runs, n_agents, n_weights)
        # [run, species]: index of the first agent of each species.
        first_agents = np.cumsum(sizes, axis=1) - sizes
        for species, member in enumerate(self._members):
            seed = derive_seed(self._seed, species)
            # Each group is a pair: index of the first agent, number of agents. Runs of one group
            # are simulated in one batch.
            groups = {(*pair,) for pair in np.stack([first_agents, sizes])[:, :, species].T}
            for first_agent, size in sorted(groups):
                is_in_group = (first_agents[:, species] == first_agent) & (
                    sizes[:, species] == size
                )
                run_indices = np.flatnonzero(is_in_group)
                if size == 0:
                    continue
                agents = slice(first_agent, first_agent + size)
                used = trim_genomes(genomes[run_indices, agents], member)
                runs = [self._runs[index] for index in run_indices.tolist()]
                results = _ModelSimulator(member, seed, runs).simulate(generation, used)
                collected.add(results, run_indices, agents, used)
        return collected.finish()


class _Results:
    """Results of all agents. Each call of `add` copies the results of one species in some runs."""

    def __init__(self, n_runs: int, n_agents: int, n_weights: int) -> None:
        self._shape = (n_runs, n_agents)
        self._energy = np.zeros(self._shape)
        self._cost = np.zeros(self._shape)
        self._learned = np.zeros((*self._shape, n_weights), np.float32)
        self._has_learned = False
        self._records: dict[str, npt.NDArray[Any]] = {}

    def add(
        self,
        results: LifeResults,
        runs: npt.NDArray[np.int64],
        agents: slice,
        genomes: npt.NDArray[np.float32],
    ) -> None:
        """Copy the results of one species. `runs` [run]: indices of the runs in these results."""
        self._energy[runs, agents] = results.energy
        self._cost[runs, agents] = results.cost
        # A model without learned weights does not change the first module during a lifetime.
        has_learned = results.learned is not None
        learned = genomes[:, :, 0] if results.learned is None else results.learned
        self._learned[runs, agents, : learned.shape[-1]] = learned
        self._has_learned |= has_learned
        for name, values in results.records.items():
            array = self._records.setdefault(name, np.zeros(self._shape, values.dtype))
            array[runs, agents] = values

    def finish(self) -> LifeResults:
        """Return the results. `learned` is None if no species has learned weights."""
        return LifeResults(
            energy=self._energy,
            cost=self._cost,
            learned=self._learned if self._has_learned else None,
            records=self._records,
        )


class _ScheduledSimulator:
    """Simulator with settings that change. Each set of settings has a separate simulator."""

    def __init__(
        self, experiment: BaseExperiment, seed: int, runs: Sequence[int], backend: Any
    ) -> None:
        self._experiment = experiment
        self._make_simulator = partial(make_simulator, seed=seed, runs=runs, backend=backend)
        self._simulators: dict[BaseExperiment, Simulator] = {}

    def simulate(
        self, generation: int, genomes: npt.NDArray[np.float32], *sizes: Any
    ) -> LifeResults:
        settings = self._experiment.at(generation)
        # A period without learning uses fewer modules and genes than the stored genomes have.
        used_genes = trim_genomes(genomes, settings)
        if settings not in self._simulators:
            self._simulators[settings] = self._make_simulator(settings)
        return self._simulators[settings].simulate(generation, used_genes, *sizes)


def make_simulator(
    experiment: BaseExperiment, seed: int, runs: Sequence[int], backend: Any = None
) -> Simulator:
    """Return a simulator of `runs`. Backends other than the CPU, the default, need MiniWorld."""
    if experiment.schedule:
        return _ScheduledSimulator(experiment, seed, runs, backend)
    if experiment.population.species and isinstance(experiment, Experiment):
        from baldwinlab.models.miniworld.species import SpeciesSimulator

        return SpeciesSimulator(experiment, seed, runs, backend)
    if isinstance(experiment, Experiment):
        from baldwinlab.models.miniworld.lifetimes import MiniWorldSimulator

        return MiniWorldSimulator(experiment, seed, runs, backend)
    if backend is not None and backend.name != "cpu":
        raise ValueError(
            f"backend = {backend.name!r} must be cpu or auto: the model {experiment.model!r} runs "
            "on the CPU only"
        )
    if experiment.population.species:
        return SpeciesModelSimulator(experiment, seed, runs)
    return _ModelSimulator(experiment, seed, runs)
