"""The lives of foragers, as every model's: genomes in, energy out."""

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
    """Several runs of one experiment that live side by side."""

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
    """What has become of the lives in a batch that began with `genomes` [run, agent, module, weight]."""
    regions, eaten = item_regions(experiment), batch.eaten_in_life()
    final_population = None
    births: dict[str, Any] = {}
    if experiment.births_in_life:
        state, runs = batch.state, slice(len(genomes))
        final_population = FinalPopulation(state.genome[runs].copy(), state.origin[runs].copy())
        genomes = final_population.genome
        births = {"born": state.born[runs].copy()}
    energies = np.array([region.energy for region in regions] or [0.0], np.float64)
    learned = batch.weights() if experiment.learns else None
    each = zip(genomes, learned if learned is not None else [None] * len(genomes), strict=True)
    return LifeResults(
        energy=np.stack([sum_energy(energies, one) for one in eaten]),
        cost=np.stack(
            [compute_learning_cost(experiment, genome, of_run) for genome, of_run in each]
        ),
        learned=learned,
        records=eaten_by_kind(experiment, eaten) | births,
        final_population=final_population,
    )


def eaten_by_kind(
    experiment: Experiment, eaten: npt.NDArray[np.int32]
) -> dict[str, npt.NDArray[np.int32]]:
    """Items eaten in life [run, agent]: food, and every other kind by its name; of `eaten` [run, agent, region]."""
    kinds = [region.kind for region in item_regions(experiment)] or [FOOD]
    return {
        "food_eaten" if kind == FOOD else f"{kind}_eaten": eaten[
            ..., [k == kind for k in kinds]
        ].sum(axis=-1, dtype=np.int32)
        for kind in item_kinds(experiment)
    }
