"""Simulator of lifetimes of MiniWorld agents, which returns results for evolution and records."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import eaten_variable
from baldwinlab.evolution.fitness import compute_learning_cost, sum_energy
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import choose_population, read_part_records
from baldwinlab.models.miniworld.backends.choice import CPU, Backend, Batch
from baldwinlab.models.miniworld.population import FixedPopulation
from baldwinlab.models.miniworld.regions import eaten_energies, item_kinds, item_regions
from baldwinlab.models.miniworld.state import FOOD, State
from baldwinlab.parts.model_part import FinalPopulation, LifeResults


class MiniWorldSimulator:
    """Simulate several runs of one experiment side by side."""

    def __init__(
        self, experiment: Experiment, seed: int, runs: Sequence[int], backend: Backend | None = None
    ) -> None:
        self._experiment = experiment
        backend = backend or CPU
        # A batch of the backend has a world for each repeat of a lifetime.
        self._batch_size = max(1, backend.worlds // experiment.lifetime.repeats)
        self._batches = [
            backend.batch(experiment, seed, runs[first : first + self._batch_size])
            for first in range(0, len(runs), self._batch_size)
        ]

    def simulate(self, generation: int, genomes: npt.NDArray[np.float32]) -> LifeResults:
        """Return the results of a generation with `genomes` [run, agent, module, weight]."""
        size = self._batch_size
        return join_runs(
            [
                self._simulate_batch(batch, generation, genomes[index * size : (index + 1) * size])
                for index, batch in enumerate(self._batches)
            ]
        )

    def _simulate_batch(
        self, batch: Batch, generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        """Simulate the runs of one batch of the backend."""
        batch.begin(generation, genomes)
        if self._experiment.record.every is None:
            batch.simulate(0, self._experiment.lifetime.steps)
            return collect_results(self._experiment, batch, genomes)
        series = simulate_windows(self._experiment, batch, len(genomes))
        results = collect_results(self._experiment, batch, genomes)
        return results._replace(records={**results.records, **series})


def join_runs(groups: Sequence[LifeResults]) -> LifeResults:
    """Return the results of the runs of several batches as those of one batch."""
    if len(groups) == 1:
        return groups[0]

    def join(values: Sequence[Any]) -> Any:
        if values[0] is None:
            return None
        if isinstance(values[0], Mapping):
            return {name: join([group[name] for group in values]) for name in values[0]}
        if isinstance(values[0], FinalPopulation):
            return FinalPopulation(*map(join, zip(*values, strict=True)))
        return np.concatenate(values)

    joined = {
        name: join([getattr(group, name) for group in groups])
        for name in LifeResults._fields
        if name != "lifetimes"
    }
    lifetimes = zip(*(group.lifetimes for group in groups), strict=True)
    return LifeResults(**joined, lifetimes=tuple(map(join_runs, lifetimes)))


def collect_results(
    experiment: Experiment, batch: Batch, genomes: npt.NDArray[np.float32]
) -> LifeResults:
    """Return the combined results of all repeats. `genomes` is [run, agent, module, weight]."""
    n_runs = len(genomes)
    eaten = batch.eaten_in_life()
    positions = batch.positions()
    learned_weights = batch.weights() if experiment.learns else None
    lifetimes = []
    for repeat in range(len(eaten) // n_runs):
        # The arrays have a row for each repeat of each run, ordered by repeat, then by run.
        populations = slice(repeat * n_runs, (repeat + 1) * n_runs)
        learned = None if learned_weights is None else learned_weights[populations]
        outcomes = _Outcomes(repeat, eaten[populations], positions[populations], learned)
        lifetimes.append(_collect_lifetime(experiment, batch, genomes, outcomes))
    return combine_lifetimes(lifetimes)


class _Outcomes(NamedTuple):
    """Index of a repeat, and the results of this repeat."""

    repeat: int
    eaten: npt.NDArray[np.int32]  # [run, agent, row of `State.eaten_in_life`].
    positions: npt.NDArray[np.float32]  # [run, agent, (x, y)].
    learned: npt.NDArray[np.float32] | None  # [run, agent, weight].


def _collect_lifetime(
    experiment: Experiment,
    batch: Batch,
    genomes: npt.NDArray[np.float32],
    outcomes: _Outcomes,
) -> LifeResults:
    """Return the results of one lifetime of each agent, [run, agent, ...]."""
    repeat, eaten, positions, learned_weights = outcomes
    shape = genomes.shape[:2]
    first_lane = repeat * math.prod(shape)
    final_population = None
    added_records: dict[str, Any] = {}
    steps_learned = None
    if experiment.births_in_life:
        state = batch.state
        runs = slice(len(genomes))
        final_population = FinalPopulation(state.genome[runs].copy(), state.origin[runs].copy())
        # Births have replaced the initial genomes.
        genomes = final_population.genome
        added_records["born"] = state.birth_count[runs].copy()
    if choose_population(experiment) is not FixedPopulation:
        steps_learned = reshape_lanes(batch.state.population.steps_learned, shape, first_lane)
    if experiment.has_deaths:
        added_records |= read_death_records(batch.state, shape, first_lane)
    if experiment.part_records:
        added_records |= read_part_records(batch.state, shape, first_lane)
    item_energies = np.array(eaten_energies(experiment) or [0.0], np.float64)
    return LifeResults(
        energy=sum_energy(item_energies, eaten),
        cost=compute_learning_cost(experiment, genomes, learned_weights, steps_learned),
        learned=learned_weights,
        records=eaten_by_kind(experiment, eaten) | added_records,
        final_population=final_population,
        eaten=eaten,
        position=positions,
    )


def eaten_by_kind(
    experiment: Experiment, eaten: npt.NDArray[np.int32]
) -> dict[str, npt.NDArray[np.int32]]:
    """Return the numbers of eaten items and agents [run, agent], by variable of the eaten kind.

    `eaten` is [run, agent, row of `State.eaten_in_life`].
    """
    region_kinds = [region.kind for region in item_regions(experiment)] or [FOOD]
    records = {}
    for kind in item_kinds(experiment):
        is_kind = [region_kind == kind for region_kind in region_kinds]
        eaten_items = eaten[..., : len(is_kind)]
        records[eaten_variable(kind)] = eaten_items[..., is_kind].sum(axis=-1, dtype=np.int32)
    for prey_index, prey in enumerate(experiment.eats.prey):
        records[eaten_variable(prey.species)] = eaten[..., len(region_kinds) + prey_index]
    return records


def read_death_records(
    state: State, shape: tuple[int, ...], first_lane: int = 0
) -> dict[str, npt.NDArray[np.int32]]:
    """Return the records of deaths [run, agent]: "alive" (1 or 0) and "age" (in steps)."""
    return {
        "alive": reshape_lanes(state.alive, shape, first_lane).astype(np.int32),
        "age": reshape_lanes(state.population.age, shape, first_lane),
    }


def reshape_lanes(
    values: npt.NDArray[Any], shape: tuple[int, ...], first_lane: int = 0
) -> npt.NDArray[Any]:
    """Return a copy of an array [1, lane], from a first lane on, as [run, agent]."""
    lanes = slice(first_lane, first_lane + math.prod(shape))
    return values[0, lanes].reshape(shape).copy()


def combine_lifetimes(lifetimes: Sequence[LifeResults]) -> LifeResults:
    """Return the means of the results of several lifetimes of the same agents.

    `eaten` is the sum over the lifetimes. The learned weights and the final positions are from the
    first lifetime. The entry `lifetimes` has all results. A single lifetime is returned unchanged.
    """
    first_lifetime = lifetimes[0]
    if len(lifetimes) == 1:
        return first_lifetime
    records: dict[str, Any] = {
        name: np.mean([results.records[name] for results in lifetimes], axis=0, dtype=np.float64)
        for name in first_lifetime.records
    }
    eaten = [results.eaten for results in lifetimes if results.eaten is not None]
    return first_lifetime._replace(
        eaten=np.sum(eaten, axis=0, dtype=np.int32),
        energy=np.mean([results.energy for results in lifetimes], axis=0),
        cost=np.mean([results.cost for results in lifetimes], axis=0),
        records=records,
        lifetimes=tuple(lifetimes),
    )


# Array [run, window].
Series = npt.NDArray[np.float64]


def simulate_windows(experiment: Experiment, batch: Batch, n_runs: int) -> Mapping[str, Series]:
    """Simulate a lifetime. Return time series by name, [run, window of `record.every` steps]."""
    steps = experiment.lifetime.steps
    interval = experiment.record.every or steps
    # A batch without items has arrays of one region.
    item_energies = np.array(eaten_energies(experiment) or [0.0], np.float64)
    alive: list[npt.NDArray[np.float64]] = []
    births: list[npt.NDArray[np.float64]] = []
    energies: list[npt.NDArray[np.float64]] = []
    for first_step in range(0, steps, interval):
        batch.simulate(first_step, min(first_step + interval, steps))
        eaten = batch.eaten_in_life()
        alive.append(_count_alive(experiment, batch, len(eaten)))
        births.append(_count_births(experiment, batch, len(eaten)))
        energies.append(eaten.sum(axis=1, dtype=np.float64) @ item_energies)
    # Differences of totals since the start are the values of a window.
    totals = {"births": births, "energy_gained": energies}
    series = {name: np.diff(np.stack(values), axis=0, prepend=0) for name, values in totals.items()}
    series["agents_alive"] = np.stack(alive)
    # Populations are ordered by repeat, then by run. The result is the mean over the repeats.
    return {
        name: np.asarray(values.T.reshape(-1, n_runs, len(values)).mean(axis=0))
        for name, values in series.items()
    }


def _count_alive(
    experiment: Experiment, batch: Batch, n_populations: int
) -> npt.NDArray[np.float64]:
    """Return the number of agents that are alive, [population]."""
    size = experiment.population.size
    if not experiment.has_deaths:
        return np.full(n_populations, float(size))
    lanes = slice(n_populations * size)
    is_alive = batch.state.alive[0, lanes].reshape(n_populations, size)
    return np.asarray(is_alive.sum(axis=1), np.float64)


def _count_births(
    experiment: Experiment, batch: Batch, n_populations: int
) -> npt.NDArray[np.float64]:
    """Return the number of births in this lifetime, [population]."""
    if not experiment.births_in_life:
        return np.zeros(n_populations)
    # Each population has one world. On the GPU, further worlds follow that fill a thread block.
    return np.asarray(batch.state.birth_count[:n_populations].sum(axis=1), np.float64)
