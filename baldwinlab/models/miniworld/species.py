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
from baldwinlab.models.miniworld.allocation import read_part_records
from baldwinlab.models.miniworld.backends.choice import CPU, Backend, require_species_batch
from baldwinlab.models.miniworld.backends.cpu import PopulationView
from baldwinlab.models.miniworld.backends.species import SpeciesBatch
from baldwinlab.models.miniworld.lifetimes import (
    eaten_by_kind,
    read_death_records,
    reshape_lanes,
)
from baldwinlab.models.miniworld.regions import eaten_energies
from baldwinlab.parts.model_part import LifeResults

Sizes = tuple[int, ...]
"""Number of agents of each species."""


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
        uses its first modules and weights. `sizes` [run, species]: number of agents of each
        species.
        """
        runs_by_sizes: dict[Sizes, list[int]] = {}
        for run_index, run_sizes in enumerate(sizes.tolist()):
            runs_by_sizes.setdefault(tuple(run_sizes), []).append(run_index)
        # Batches of other sizes are freed.
        batches = self._batches
        self._batches = {}
        results: list[Any] = [None] * len(genomes)
        for group_sizes, run_indices in runs_by_sizes.items():
            key = group_sizes, tuple(run_indices)
            runs = [self._runs[run_index] for run_index in run_indices]
            batch = batches.get(key) or self._batch_class(
                self._experiment, self._seed, runs, group_sizes
            )
            self._batches[key] = batch
            group_results = self._simulate_batch(batch, generation, genomes[run_indices])
            for run_index, run_results in zip(run_indices, group_results, strict=True):
                results[run_index] = run_results
        return _stack_runs(results)

    def _simulate_batch(
        self, batch: SpeciesBatch, generation: int, genomes: npt.NDArray[np.float32]
    ) -> list[LifeResults]:
        """Return the results of each run of a batch, whose arrays have no axis of runs."""
        genomes_of_species = split_genomes(batch.members, genomes)
        batch.begin(generation, genomes_of_species)
        batch.simulate(0, self._experiment.lifetime.steps)
        results_of_species = [
            _collect_species(member, view, member_genomes, self._experiment.has_deaths)
            for member, view, member_genomes in zip(
                batch.members, batch.views(), genomes_of_species, strict=True
            )
        ]
        learns = self._experiment.learns
        return [
            _join_species([results[run_index] for results in results_of_species], learns)
            for run_index in range(len(genomes))
        ]


def make_species_batch(
    experiment: Experiment,
    seed: int,
    run: int,
    generation: int,
    genomes: npt.NDArray[np.float32],
    species: SpeciesIndices,
) -> SpeciesBatch:
    """Return a batch of one run with several species before its first step.

    `genomes` [agent, module, weight] are those of all agents, and `species` [agent] their species.
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
    view: PopulationView,
    genomes: npt.NDArray[np.float32],
    has_deaths: bool,
) -> list[LifeResults]:
    """Return the results of a species for each run of a batch."""
    eaten = view.eaten_in_life()
    positions = view.positions()
    weights = view.weights()
    shape = genomes.shape[:2]
    records: dict[str, npt.NDArray[Any]] = dict(eaten_by_kind(member, eaten))
    if has_deaths:
        records |= read_death_records(view.state, shape)
    if member.part_records:
        records |= read_part_records(view.state, shape)
    steps_learned = reshape_lanes(view.state.population.steps_learned, shape)
    energies = np.array(eaten_energies(member) or [0.0], np.float64)

    def collect_run(run: int) -> LifeResults:
        return LifeResults(
            energy=sum_energy(energies, eaten[run]),
            cost=compute_learning_cost(member, genomes[run], weights[run], steps_learned[run]),
            learned=weights[run],
            records={name: values[run] for name, values in records.items()},
            eaten=eaten[run],
            position=positions[run],
        )

    return [collect_run(run) for run in range(len(genomes))]


def _join_species(results: Sequence[LifeResults], learns: bool) -> LifeResults:
    """Return the results of all agents of a run, from those of each species.

    The value of a record that a species does not have is 0. Learned weights and eaten kinds that a
    species does not have are 0, too.
    """
    names = dict.fromkeys(name for species in results for name in species.records)

    def join_records(name: str) -> npt.NDArray[Any]:
        values = []
        for species in results:
            zeros = np.zeros(len(species.energy), np.int32)
            values.append(species.records.get(name, zeros))
        return np.concatenate(values)

    return LifeResults(
        energy=np.concatenate([species.energy for species in results]),
        cost=np.concatenate([species.cost for species in results]),
        learned=_join_columns([species.learned for species in results]) if learns else None,
        records={name: join_records(name) for name in names},
        eaten=_join_columns([species.eaten for species in results]),
        position=_join_columns([species.position for species in results]),
    )


def _join_columns(arrays: Sequence[npt.NDArray[Any] | None]) -> npt.NDArray[Any]:
    """Return arrays [agent, column] as one array, with 0 in the columns that an array lacks."""
    existing = [array for array in arrays if array is not None]
    n_columns = max(array.shape[1] for array in existing)
    padded = [np.pad(array, ((0, 0), (0, n_columns - array.shape[1]))) for array in existing]
    return np.concatenate(padded)


def _stack_runs(results: Sequence[LifeResults]) -> LifeResults:
    """Return the results of all runs, from those of each run."""

    def stack(name: str) -> Any:
        values = [getattr(run, name) for run in results]
        return None if values[0] is None else np.stack(values)

    return LifeResults(
        **{name: stack(name) for name in ("energy", "cost", "learned", "eaten", "position")},
        records={
            name: np.stack([run.records[name] for run in results]) for name in results[0].records
        },
    )
