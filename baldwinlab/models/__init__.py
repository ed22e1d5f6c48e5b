"""Models, and simulators that compute their lifetimes for several runs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from baldwinlab.evolution.genes import trim_genomes
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.species import SpeciesModelSimulator
from baldwinlab.parts.model_part import LifeResults


class Simulator(Protocol):
    """Object that simulates several runs of one experiment, one generation per call.

    A run is bit-identical for all combinations of runs.
    """

    def simulate(
        self, generation: int, genomes: npt.NDArray[np.float32], *sizes: Any
    ) -> LifeResults:
        """Return the results of a generation.

        `genomes` [run, agent, module, weight]: genomes at birth. `*sizes` [run, species]: number of
        agents of each species. Only experiments with species have this argument.
        """
        ...


class _ModelSimulator:
    """The simulator of a model that is a part."""

    def __init__(self, experiment: BaseExperiment, seed: int, runs: Sequence[int]) -> None:
        self._model = experiment.model_part
        # A model does not use the genes of other parts.
        self._n_weights = experiment.weight_count
        self._seed = seed
        self._runs = runs

    def simulate(self, generation: int, genomes: npt.NDArray[np.float32]) -> LifeResults:
        weights = np.ascontiguousarray(genomes[..., : self._n_weights])
        results: LifeResults = self._model.simulate(self._seed, self._runs, generation, weights)
        return results


class _ScheduledSimulator:
    """The simulators of an experiment whose settings change at some generations."""

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
        # Without learning, an agent does not use its entire genome.
        used_genes = trim_genomes(genomes, settings)
        if settings not in self._simulators:
            self._simulators[settings] = self._make_simulator(settings)
        return self._simulators[settings].simulate(generation, used_genes, *sizes)


def make_simulator(
    experiment: BaseExperiment, seed: int, runs: Sequence[int], backend: Any = None
) -> Simulator:
    """Return a simulator of runs of an experiment. The default backend is the CPU."""
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
