"""Simulator of lifetimes of several species of MiniWorld agents that share worlds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.evolution.fitness import compute_learning_cost, sum_energy
from baldwinlab.evolution.genes import trim_genomes
from baldwinlab.evolution.species import SpeciesIndices, count_agents
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU, Backend, require_species_batch
from baldwinlab.models.miniworld.backends.species import SpeciesBatch, SpeciesView
from baldwinlab.models.miniworld.lifetimes import (
    eaten_by_kind,
    read_death_records,
    read_part_records,
)
from baldwinlab.models.miniworld.regions import eaten_energies
from baldwinlab.parts.model_part import LifeResults

Sizes = tuple[int, ...]
"""Number of agents of each species, [species]."""


class SpeciesSimulator:
    """Simulate several runs of one experiment with species."""

    def __init__(
        self,
        experiment: Experiment,
        seed: int,
        runs: Sequence[int],
        backend: Backend | None = None,
    ) -> None:
        """Create a simulator. Raise ValueError if the backend cannot simulate species."""
        self._batch_class = require_species_batch(backend or CPU)
        self._experiment = experiment
        self._seed = seed
        self._runs = runs
        self._batches: dict[tuple[Sizes, tuple[int, ...]], SpeciesBatch] = {}

    def simulate(
        self, generation: int, genomes: npt.NDArray[np.float32], sizes: npt.NDArray[np.int64]
    ) -> LifeResults:
        """Return the results of a generation.

        `genomes` [run, agent, module, weight]: genomes at birth, species after species. A species
        with fewer modules or weights uses the first of them. `sizes` [run, species]: number of
        agents of each species.
        """
        runs_by_sizes: dict[Sizes, list[int]] = {}
        for run_index, run_sizes in enumerate(sizes.tolist()):
            runs_by_sizes.setdefault(tuple(run_sizes), []).append(run_index)
        # A batch has runs of equal sizes. Batches that this generation does not use are freed.
        batches = self._batches
        self._batches = {}
        results = []
        for group_sizes, run_indices in runs_by_sizes.items():
            key = group_sizes, tuple(run_indices)
            runs = [self._runs[run_index] for run_index in run_indices]
            batch = batches.get(key) or self._batch_class(
                self._experiment, self._seed, runs, group_sizes
            )
            self._batches[key] = batch
            results.append(self._simulate_batch(batch, generation, genomes[run_indices]))
        return _order_runs(results, [run for runs in runs_by_sizes.values() for run in runs])

    def _simulate_batch(
        self, batch: SpeciesBatch, generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        genomes_of_species = split_genomes(batch.members, genomes)
        batch.begin(generation, genomes_of_species)
        batch.simulate(0, self._experiment.lifetime.steps)
        results_of_species = [
            _collect_species(member, view, member_genomes, self._experiment.has_deaths)
            for member, view, member_genomes in zip(
                batch.members, batch.views(), genomes_of_species, strict=True
            )
        ]
        return _join_species(results_of_species, self._experiment.learns)


def make_species_batch(
    experiment: Experiment,
    seed: int,
    run: int,
    generation: int,
    genomes: npt.NDArray[np.float32],
    species: SpeciesIndices,
) -> SpeciesBatch:
    """Return a batch of one run with several species, before the first step.

    `genomes` [agent, module, weight]: genomes, species after species. `species` [agent]: index of
    the species of each agent.
    """
    settings = experiment.at(generation)
    sizes = count_agents(species, len(experiment.population.species)).tolist()
    batch = SpeciesBatch(settings, seed, [run], sizes)
    batch.begin(generation, split_genomes(batch.members, genomes[None]))
    return batch


def split_genomes(
    members: Sequence[Experiment], genomes: npt.NDArray[np.float32]
) -> list[npt.NDArray[np.float32]]:
    """Return the genomes of each species, from all genomes [run, agent, module, weight]."""
    genomes_of_species = []
    first_agent = 0
    for member in members:
        end = first_agent + member.population.size
        genomes_of_species.append(trim_genomes(genomes[:, first_agent:end], member))
        first_agent = end
    return genomes_of_species


def _collect_species(
    member: Experiment,
    view: SpeciesView,
    genomes: npt.NDArray[np.float32],
    has_deaths: bool,
) -> LifeResults:
    """Return the results [run, agent, ...] of one species of a batch."""
    eaten = view.eaten_in_life()
    weights = view.weights()
    records: dict[str, npt.NDArray[Any]] = dict(eaten_by_kind(member, eaten))
    if has_deaths:
        records |= read_death_records(view)
    if member.part_records:
        records |= read_part_records(view)
    steps_learned = view.by_agent("population.steps_learned")[..., 0]
    energies = np.array(eaten_energies(member) or [0.0], np.float64)
    costs = [
        compute_learning_cost(member, *values)
        for values in zip(genomes, weights, steps_learned, strict=True)
    ]
    return LifeResults(
        energy=np.stack([sum_energy(energies, eaten_in_run) for eaten_in_run in eaten]),
        cost=np.stack(costs),
        learned=weights,
        records=records,
        eaten=eaten,
        position=view.positions(),
    )


def _join_species(results: Sequence[LifeResults], learns: bool) -> LifeResults:
    """Return the results of all agents of a batch, from the results of each species.

    Records, weights and eaten kinds that a species does not have are 0.
    """
    names = dict.fromkeys(name for species in results for name in species.records)

    def join_records(name: str) -> npt.NDArray[Any]:
        values = []
        for species in results:
            zeros = np.zeros(species.energy.shape, np.int32)
            values.append(species.records.get(name, zeros))
        return np.concatenate(values, axis=1)

    return LifeResults(
        energy=np.concatenate([species.energy for species in results], axis=1),
        cost=np.concatenate([species.cost for species in results], axis=1),
        learned=_join_columns([species.learned for species in results]) if learns else None,
        records={name: join_records(name) for name in names},
        eaten=_join_columns([species.eaten for species in results]),
        position=_join_columns([species.position for species in results]),
    )


def _join_columns(arrays: Sequence[npt.NDArray[Any] | None]) -> npt.NDArray[Any]:
    """Join arrays [run, agent, column] along the agents, with 0 in columns that an array lacks."""
    existing = [array for array in arrays if array is not None]
    n_columns = max(array.shape[2] for array in existing)
    padding = [((0, 0), (0, 0), (0, n_columns - array.shape[2])) for array in existing]
    return np.concatenate(list(map(np.pad, existing, padding)), axis=1)


def _order_runs(results: Sequence[LifeResults], runs: Sequence[int]) -> LifeResults:
    """Join the results of batches, sorted by run. `runs` are indices in the order of batches."""
    order = np.argsort(runs)

    def join(values: Sequence[npt.NDArray[Any] | None]) -> Any:
        existing = [array for array in values if array is not None]
        return np.concatenate(existing)[order] if existing else None

    return LifeResults(
        **{
            name: join([getattr(batch, name) for batch in results])
            for name in ("energy", "cost", "learned", "eaten", "position")
        },
        records={
            name: join([batch.records[name] for batch in results]) for name in results[0].records
        },
    )
