"""Simulate lifetimes of MiniWorld agents: from genomes to energy and learned weights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.evolution.fitness import compute_learning_cost, sum_energy
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import item_kinds, item_regions
from baldwinlab.models.miniworld.backends.choice import CPU, Backend, Batch
from baldwinlab.models.miniworld.state import FOOD
from baldwinlab.parts.model_part import FinalPopulation, LifeResults


class MiniWorldSimulator:
    """Simulate several runs of one experiment side by side."""

    def __init__(
        self, experiment: Experiment, seed: int, runs: Sequence[int], backend: Backend | None = None
    ) -> None:
        self._experiment = experiment
        self._batch = (backend or CPU).batch(experiment, seed, runs)

    def simulate(self, generation: int, genomes: npt.NDArray[np.float32]) -> LifeResults:
        self._batch.begin(generation, genomes)
        self._batch.simulate(0, self._experiment.lifetime.steps)
        return collect_results(self._experiment, self._batch, genomes)


def collect_results(
    experiment: Experiment, batch: Batch, genomes: npt.NDArray[np.float32]
) -> LifeResults:
    """Return the results of a batch that began with `genomes` [run, agent, module, weight]."""
    regions = item_regions(experiment)
    eaten = batch.eaten_in_life()
    final_population = None
    births: dict[str, Any] = {}
    if experiment.births_in_life:
        state = batch.state
        runs = slice(len(genomes))
        final_population = FinalPopulation(state.genome[runs].copy(), state.origin[runs].copy())
        genomes = final_population.genome
        births = {"born": state.birth_count[runs].copy()}
    energies = np.array([region.energy for region in regions] or [0.0], np.float64)
    learned = batch.weights() if experiment.learns else None
    learned_by_run = [None] * len(genomes) if learned is None else learned
    costs = [
        compute_learning_cost(experiment, genome, learned_weights)
        for genome, learned_weights in zip(genomes, learned_by_run, strict=True)
    ]
    return LifeResults(
        energy=np.stack([sum_energy(energies, eaten_in_run) for eaten_in_run in eaten]),
        cost=np.stack(costs),
        learned=learned,
        records=eaten_by_kind(experiment, eaten) | births,
        final_population=final_population,
    )


def eaten_by_kind(
    experiment: Experiment, eaten: npt.NDArray[np.int32]
) -> dict[str, npt.NDArray[np.int32]]:
    """Return items eaten per kind, [run, agent], from `eaten` [run, agent, region]."""
    kinds = [region.kind for region in item_regions(experiment)] or [FOOD]
    return {
        "food_eaten" if kind == FOOD else f"{kind}_eaten": eaten[
            ..., [k == kind for k in kinds]
        ].sum(axis=-1, dtype=np.int32)
        for kind in item_kinds(experiment)
    }
