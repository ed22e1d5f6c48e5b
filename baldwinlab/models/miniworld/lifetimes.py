"""Simulator of lifetimes of MiniWorld agents, which returns results for evolution and records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import eaten_variable
from baldwinlab.evolution.fitness import compute_learning_cost, sum_energy
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import choose_population, list_parts
from baldwinlab.models.miniworld.backends.choice import CPU, Backend, Batch, SimulatedAgents
from baldwinlab.models.miniworld.population import FixedPopulation
from baldwinlab.models.miniworld.regions import eaten_energies, item_kinds, item_regions
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
        """Return the results of a generation with `genomes` [run, agent, module, weight]."""
        self._batch.begin(generation, genomes)
        if self._experiment.record.every is None:
            self._batch.simulate(0, self._experiment.lifetime.steps)
            return collect_results(self._experiment, self._batch, genomes)
        series = simulate_windows(self._experiment, self._batch, len(genomes))
        results = collect_results(self._experiment, self._batch, genomes)
        return results._replace(records={**results.records, **series})


def collect_results(
    experiment: Experiment, batch: Batch, genomes: npt.NDArray[np.float32]
) -> LifeResults:
    """Return the combined results of all repeats. `genomes` is [run, agent, module, weight]."""
    # The arrays have a row for each repeat of each run, ordered by repeat, then by run.
    eaten = batch.eaten_in_life()
    learned = batch.weights() if experiment.learns else None
    n_runs = len(genomes)
    n_repeats = len(eaten) // n_runs
    final_population = None
    if experiment.births_in_life:
        final_population = FinalPopulation(batch.by_world("genome"), batch.by_world("origin"))
        # Births have replaced the initial genomes.
        genomes = final_population.genome
    elif n_repeats > 1:
        genomes = np.tile(genomes, (n_repeats, 1, 1, 1))
    steps_learned = None
    if choose_population(experiment) is not FixedPopulation:
        steps_learned = batch.by_agent("population.steps_learned")[..., 0]
    item_energies = np.array(eaten_energies(experiment) or [0.0], np.float64)
    results = LifeResults(
        energy=sum_energy(item_energies, eaten),
        cost=compute_learning_cost(experiment, genomes, learned, steps_learned),
        learned=learned,
        records=eaten_by_kind(experiment, eaten) | _read_records(experiment, batch),
        final_population=final_population,
        eaten=eaten,
        position=batch.positions(),
    )
    if n_repeats == 1:
        return results
    return combine_lifetimes(
        [
            _select_rows(results, slice(repeat * n_runs, (repeat + 1) * n_runs))
            for repeat in range(n_repeats)
        ]
    )


def _select_rows(results: LifeResults, rows: slice) -> LifeResults:
    """Return the results of one repeat."""
    return LifeResults(
        energy=results.energy[rows],
        cost=results.cost[rows],
        learned=None if results.learned is None else results.learned[rows],
        records={name: array[rows] for name, array in results.records.items()},
        eaten=None if results.eaten is None else results.eaten[rows],
        position=None if results.position is None else results.position[rows],
    )


def _read_records(experiment: Experiment, batch: Batch) -> dict[str, npt.NDArray[Any]]:
    """Return the records of births, deaths and parts, [population, agent]."""
    records = {}
    if experiment.births_in_life:
        records["born"] = batch.by_world("birth_count")
    if experiment.has_deaths:
        records |= read_death_records(batch)
    if experiment.part_records:
        records |= read_part_records(batch)
    return records


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


def read_death_records(agents: SimulatedAgents) -> dict[str, npt.NDArray[np.int32]]:
    """Return the records of deaths [population, agent]: "alive" (1 or 0) and "age" (in steps)."""
    return {
        "alive": agents.by_agent("alive")[..., 0].astype(np.int32),
        "age": agents.by_agent("population.age")[..., 0],
    }


def read_part_records(agents: SimulatedAgents) -> dict[str, npt.NDArray[Any]]:
    """Return the records of all parts by name, [population, agent]."""
    return {
        name: agents.by_agent(f"{path}.{name}")[..., 0]
        for path, part in list_parts(agents.state)
        for name in getattr(type(part).part, "records", ())
    }


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
    return np.asarray(batch.by_agent("alive")[..., 0].sum(axis=1), np.float64)


def _count_births(
    experiment: Experiment, batch: Batch, n_populations: int
) -> npt.NDArray[np.float64]:
    """Return the number of births in this lifetime, [population]."""
    if not experiment.births_in_life:
        return np.zeros(n_populations)
    return np.asarray(batch.by_world("birth_count").sum(axis=1), np.float64)
