"""The models: kinds of life. `make_simulator` is how runs and assays live them, whichever it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.model_part import LifeResults


class Simulator(Protocol):
    """Several runs of one experiment that live side by side, a generation at a time. A run's bits do not depend on the others."""

    def simulate(self, generation: int, genomes: npt.NDArray[np.float32]) -> LifeResults:
        """The lives of a generation; `genomes` is [run, agent, module, weight]."""
        ...


class _ModelSimulator:
    """The lives of a model that is a part."""

    def __init__(self, experiment: BaseExperiment, seed: int, runs: Sequence[int]) -> None:
        self._model, self._seed, self._runs = experiment.of_model, seed, runs

    def simulate(self, generation: int, genomes: npt.NDArray[np.float32]) -> LifeResults:
        lives: LifeResults = self._model.simulate(self._seed, self._runs, generation, genomes)
        return lives


def make_simulator(
    experiment: BaseExperiment, seed: int, runs: Sequence[int], backend: Any = None
) -> Simulator:
    """Runs of an experiment, ready to live on a backend, the CPU unless one is given. Raises ValueError where it cannot."""
    if isinstance(experiment, Experiment):
        from baldwinlab.models.miniworld.lifetimes import MiniWorldSimulator

        return MiniWorldSimulator(experiment, seed, runs, backend)
    if backend is not None and backend.name != "cpu":
        raise ValueError(
            f"the model {experiment.model!r} lives on the CPU alone: backend = {backend.name!r} must be cpu or auto"
        )
    return _ModelSimulator(experiment, seed, runs)
