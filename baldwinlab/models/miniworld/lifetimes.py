"""Simulator of lifetimes of MiniWorld agents: from genomes to energy and learned weights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.evolution.fitness import compute_learning_cost, sum_energy
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import (
    choose_population,
    eaten_energies,
    item_kinds,
    item_regions,
)
from baldwinlab.models.miniworld.backends.choice import CPU, Backend, Batch
from baldwinlab.models.miniworld.population import FixedPopulation
from baldwinlab.models.miniworld.state import FOOD, State
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
    eaten = batch.eaten_in_life()
    shape = genomes.shape[:2]
    final_population = None
    added_records: dict[str, Any] = {}
    steps_learned: Sequence[Any] = [None] * len(genomes)
    if experiment.births_in_life:
        state = batch.state
        runs = slice(len(genomes))
        final_population = FinalPopulation(state.genome[runs].copy(), state.origin[runs].copy())
        # Births have replaced the initial genomes.
        genomes = final_population.genome
        added_records["born"] = state.birth_count[runs].copy()
    if choose_population(experiment) is not FixedPopulation:
        steps_learned = reshape_lanes(batch.state.population.steps_learned, shape)
    if experiment.has_deaths:
        added_records |= read_death_records(batch.state, shape)
    item_energies = np.array(eaten_energies(experiment) or [0.0], np.float64)
    learned_weights = batch.weights() if experiment.learns else None
    weights_by_run = [None] * len(genomes) if learned_weights is None else learned_weights
    costs = [
        compute_learning_cost(experiment, genome, weights, steps)
        for genome, weights, steps in zip(genomes, weights_by_run, steps_learned, strict=True)
    ]
    return LifeResults(
        energy=np.stack([sum_energy(item_energies, eaten_in_run) for eaten_in_run in eaten]),
        cost=np.stack(costs),
        learned=learned_weights,
        records=eaten_by_kind(experiment, eaten) | added_records,
        final_population=final_population,
    )


def eaten_by_kind(
    experiment: Experiment, eaten: npt.NDArray[np.int32]
) -> dict[str, npt.NDArray[np.int32]]:
    """Return the numbers of eaten items and agents by variable of their kind, [run, agent].

    `eaten` is [run, agent, row of `State.eaten_in_life`].
    """
    region_kinds = [region.kind for region in item_regions(experiment)] or [FOOD]
    records = {}
    for kind in item_kinds(experiment):
        is_kind = [region_kind == kind for region_kind in region_kinds]
        eaten_items = eaten[..., : len(is_kind)]
        records[f"{kind}_eaten"] = eaten_items[..., is_kind].sum(axis=-1, dtype=np.int32)
    for number, prey in enumerate(experiment.eats.prey):
        records[f"{prey.species}_eaten"] = eaten[..., len(region_kinds) + number]
    return records


def read_death_records(state: State, shape: tuple[int, ...]) -> dict[str, npt.NDArray[np.int32]]:
    """Return the records of deaths by variable, [run, agent]."""
    return {
        "alive": reshape_lanes(state.alive, shape).astype(np.int32),
        "age": reshape_lanes(state.population.age, shape),
    }


def reshape_lanes(values: npt.NDArray[Any], shape: tuple[int, ...]) -> npt.NDArray[Any]:
    """Return a copy of an array [1, lane] as [run, agent]."""
    return values[0, : math.prod(shape)].reshape(shape).copy()
