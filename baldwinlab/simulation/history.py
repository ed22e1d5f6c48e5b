"""Histories of the runs of a batch: recorded variables, saved genomes, and the next generation.

`Histories` holds the arrays of all runs and makes their next generations by a constant number of
calls of compiled code. `History` is the view of one run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core import variables
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.evolution import (
    Fitness,
    Genome,
    RunKeys,
    apply_inheritance,
    find_stopped_runs,
    fitness,
    make_founders,
    make_generation,
    make_run_keys,
    mean_fitness,
    remap_parents_of_runs,
)
from baldwinlab.evolution.genes import gene_values
from baldwinlab.evolution.species import SpeciesIndices, list_initial_species
from baldwinlab.evolution.species_breeding import (
    SpeciesArrays,
    compute_species_fitness,
    inherit_within_species,
    iterate_members,
    make_offspring,
)
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts.breeding import RunArrays, uses_run_arrays
from baldwinlab.parts.lifetimes import Lifetimes, map_arrays, read_lifetimes
from baldwinlab.parts.model_part import FinalPopulation, LifeResults

# Index of the parent of an agent without parents.
NO_PARENT = -1
# Row of a run without saved genomes in a generation.
NO_ROW = -1


class BranchStart(NamedTuple):
    """First simulated generation of histories, and its genomes, [run, agent, module, weight]."""

    generation: int
    genomes: Genome


class SavedGenomes(NamedTuple):
    """Saved genomes of one generation."""

    rows: npt.NDArray[np.intp]  # The row of each run in `genomes`, NO_ROW for none, [run].
    genomes: Genome  # [row, agent, module, weight].


class Histories:
    """The recorded variables of several runs, and the genomes of their next generation.

    All runs that have not stopped have the same number of generations.

    `active` [row]: indices of the runs that have a next generation. `genomes`: genomes of the next
    generation of these runs, [row, agent, module, weight]. `species` [row, agent]: their species,
    None for an experiment without species.
    """

    def __init__(
        self,
        experiment: BaseExperiment,
        seed: int,
        runs: Sequence[int],
        records: Sequence[xr.Dataset] = (),
        start: BranchStart | None = None,
    ) -> None:
        """Begin with the founders, with the last generation of `records` [run], or with `start`."""
        self.experiment = experiment
        self.seed = seed
        self.runs = np.array(runs, np.int64)
        self.n_generations = 0
        n_runs = len(runs)
        shape = (n_runs, experiment.evolution.generations, experiment.population.size)
        self.generation_counts = np.zeros(n_runs, np.intp)
        self.is_stopped = np.zeros(n_runs, np.bool_)
        self.fitness = np.zeros(shape)
        self.parents = np.full((*shape, 2), NO_PARENT, np.int32)
        self.records: dict[str, npt.NDArray[Any]] = {}
        self.saved_genomes: dict[int, SavedGenomes] = {}
        self.active = np.arange(n_runs)
        self.species: SpeciesIndices | None = None
        if experiment.population.species:
            self.species = np.tile(list_initial_species(experiment), (n_runs, 1))
        # Arrays of each run, by species, and their copies from before the last generation.
        self.run_arrays: list[SpeciesArrays] = [{} for _ in runs]
        self.run_arrays_before: list[SpeciesArrays] = [{} for _ in runs]
        # Fitness of the last generation of the records, which is simulated again, [run, agent].
        self._expected_fitness: Fitness | None = None
        if records:
            self._restore(records)
        elif start is not None:
            self.n_generations, self.genomes = start
            self.generation_counts[:] = self.n_generations
        else:
            self.genomes = make_founders(experiment, make_run_keys(seed, runs, 0))

    def _restore(self, records: Sequence[xr.Dataset]) -> None:
        """Copy all generations of records but the last, which is simulated again.

        The last generation is simulated again because a record holds no learned weights, and no
        agents that were born during a lifetime. The next generation can depend on them. All records
        have the same number of generations.
        """
        first = records[0]
        last_generation = first.sizes["generation"] - 1
        past = slice(last_generation)
        declared = variables.record_variables(self.experiment)
        # The order of the variables is that of an uninterrupted run, so files have equal bytes.
        for name in map(str, first.data_vars):
            if name not in declared or name in variables.COMMON_RECORD_VARIABLES:
                continue
            values = np.stack([record[name].values for record in records])
            self._allocate(name, values[:, 0])[:, past] = values[:, past]
        energy = np.stack([record["energy"].values for record in records])
        self.fitness[:, past] = energy[:, past]
        # The parents of the last generation were selected before its simulation.
        for index, record in enumerate(records):
            self.parents[index, : last_generation + 1] = record["parents"].values
        saved_generations = first["kept_generation"].values.tolist()
        genomes = np.stack([record["kept_genome"].values for record in records], dtype=np.float32)
        for position, generation in enumerate(saved_generations):
            self.saved_genomes[generation] = SavedGenomes(self.active, genomes[:, position])
        self.genomes = np.ascontiguousarray(self.saved_genomes.pop(last_generation).genomes)
        if self.species is not None:
            species = [record["species"].values[last_generation] for record in records]
            self.species = np.stack(species).astype(np.int32)
        self.run_arrays = [read_run_arrays(record) for record in records]
        self._expected_fitness = energy[:, last_generation]
        self.n_generations = last_generation
        self.generation_counts[:] = last_generation

    def _allocate(self, name: str, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the array of a variable, [run, generation, ...].

        `values` [row, ...] give its type and its shape. The values of a time series are [row,
        window], and those of other variables are [row, agent].
        """
        if name not in self.records:
            shape = (len(self.runs), self.experiment.evolution.generations, *values.shape[1:])
            self.records[name] = np.zeros(shape, values.dtype)
        return self.records[name]

    @property
    def histories(self) -> list[History]:
        """Views of the runs. A stored list would be a reference cycle, which keeps the arrays."""
        return [History(self, index) for index in range(len(self.runs))]

    @property
    def _rows(self) -> Any:
        """The index of the active runs in arrays [run, ...]: a slice, if all runs are active."""
        return slice(None) if len(self.active) == len(self.runs) else self.active

    @cached_property
    def _uses_run_arrays(self) -> bool:
        """Whether a part of the evolution has arrays of the run, in a generation or a species."""
        return any(
            uses_run_arrays(member)
            for _, segment in self.experiment.segments()
            for member in segment.species_experiments() or (segment,)
        )

    def add(self, generation: int, results: LifeResults) -> None:
        """Record a generation of the active runs, and make the next one.

        The arrays of `results` are [row, ...].
        """
        settings = self.experiment.at(generation)
        rows = self._rows
        self._save_genomes(generation)
        for name, values in results.records.items():
            self._allocate(name, values)[rows, generation] = values
        self._record_genes(generation)
        if self.species is not None:
            self._allocate("species", self.species)[rows, generation] = self.species
        if self._uses_run_arrays:
            for index in self.active:
                self.run_arrays_before[index] = {
                    species: {name: array.copy() for name, array in arrays.items()}
                    for species, arrays in self.run_arrays[index].items()
                }
        lifetimes = read_lifetimes(settings, results, self.genomes, self.species)
        fitness_of_runs = self._compute_fitness(settings, results, lifetimes)
        self.fitness[rows, generation] = fitness_of_runs
        self._require_expected_fitness(generation, fitness_of_runs)
        run_arrays = self._select_run_arrays()
        is_stopped = find_stopped_runs(settings, lifetimes, fitness_of_runs, generation, run_arrays)
        self.is_stopped[rows] = is_stopped
        self.generation_counts[rows] = generation + 1
        self.n_generations = generation + 1
        is_last = self.n_generations == self.experiment.evolution.generations
        continues = np.zeros_like(is_stopped) if is_last else ~is_stopped
        if not continues.all():
            self._keep(continues)
            lifetimes = map_arrays(lifetimes, itemgetter(continues))
            fitness_of_runs = fitness_of_runs[continues]
            results = _select_population(results, continues)
        if len(self.active) > 0:
            self._make_offspring(settings, results, lifetimes, fitness_of_runs)

    def _keep(self, continues: npt.NDArray[np.bool_]) -> None:
        """Keep the rows of the runs that have a next generation."""
        self.active = self.active[continues]
        self.genomes = self.genomes[continues]
        if self.species is not None:
            self.species = self.species[continues]

    def _save_genomes(self, generation: int) -> None:
        """Save the genomes of a generation; remove those that were saved as the last ones."""
        previous = generation - 1
        is_stored = previous % self.experiment.record.genome_every == 0
        if previous >= 0 and not is_stored and previous in self.saved_genomes:
            saved = self.saved_genomes.pop(previous)
            # The last genomes of a run that stopped remain.
            stopped = np.flatnonzero(self.is_stopped & (self.generation_counts == generation))
            if stopped.size:
                rows = np.full(len(self.runs), NO_ROW)
                rows[stopped] = np.arange(stopped.size)
                genomes = saved.genomes[saved.rows[stopped]]
                self.saved_genomes[previous] = SavedGenomes(rows, genomes)
        rows = np.full(len(self.runs), NO_ROW)
        rows[self.active] = np.arange(len(self.active))
        self.saved_genomes[generation] = SavedGenomes(rows, self.genomes)

    def _record_genes(self, generation: int) -> None:
        """Record the genes of parts by name. A gene is NaN for a species without this gene."""
        names = self.experiment.gene_names
        if not names:
            return
        missing = np.full(self.genomes.shape[:2], np.nan, np.float32)
        genes = {name: missing.copy() for name in names}
        for rows, experiment, agents in self._iterate_members(self.experiment):
            # A list of rows and a slice of agents select the same agents in each row.
            values_by_name = gene_values(experiment, self.genomes[rows][:, agents])
            for name, values in values_by_name.items():
                genes[name][rows, agents] = values
        for name, values in genes.items():
            array = self._allocate(variables.gene_variable(name), values)
            array[self._rows, generation] = values

    def _iterate_members(
        self, experiment: BaseExperiment
    ) -> Iterator[tuple[npt.NDArray[np.intp], BaseExperiment, slice]]:
        """Yield rows, experiment and agents of each species; all of them without species."""
        if self.species is None:
            yield np.arange(len(self.active)), experiment, slice(None)
            return
        for rows in self._group_rows():
            for member in iterate_members(experiment, self.species[rows[0]]):
                yield rows, member.experiment, member.agents

    def _group_rows(self) -> list[npt.NDArray[np.intp]]:
        """Return the rows of runs whose agents have the same species."""
        assert self.species is not None
        _, groups = np.unique(self.species, axis=0, return_inverse=True)
        groups = groups.reshape(-1)
        return [np.flatnonzero(groups == group) for group in range(groups.max() + 1)]

    def _select_run_arrays(self) -> list[RunArrays] | None:
        """Return the arrays of each active run without species, or of the first species."""
        if not self._uses_run_arrays:
            return None
        return [self.run_arrays[index].setdefault(0, {}) for index in self.active]

    def _select_species_arrays(self, rows: npt.NDArray[np.intp]) -> list[SpeciesArrays] | None:
        """Return the arrays by species of each run of some rows."""
        if not self._uses_run_arrays:
            return None
        return [self.run_arrays[index] for index in self.active[rows]]

    def _compute_fitness(
        self, settings: BaseExperiment, results: LifeResults, lifetimes: Lifetimes
    ) -> Fitness:
        """Return the fitness of the agents of the active runs, [row, agent]."""
        if self.species is None:
            run_arrays = self._select_run_arrays()
            if results.lifetimes:
                return mean_fitness(settings, results, self.genomes, run_arrays)
            return fitness(settings, lifetimes, run_arrays)
        values = np.empty_like(lifetimes.energy)
        for rows in self._group_rows():
            lifetimes_of_group = map_arrays(lifetimes, itemgetter(rows))
            values[rows] = compute_species_fitness(
                settings, lifetimes_of_group, self._select_species_arrays(rows)
            )
        return values

    def _make_offspring(
        self,
        settings: BaseExperiment,
        results: LifeResults,
        lifetimes: Lifetimes,
        fitness_of_runs: Fitness,
    ) -> None:
        """Make the next generation of the active runs."""
        keys = make_run_keys(self.seed, self.runs[self.active], self.n_generations)
        if self.species is not None:
            self._make_offspring_of_species(settings, keys, results, lifetimes, fitness_of_runs)
            return
        run_arrays = self._select_run_arrays()
        inherited = apply_inheritance(settings, lifetimes.genome, results.learned, run_arrays)
        self.genomes, parents = make_generation(
            self.experiment, keys, inherited, fitness_of_runs, lifetimes, run_arrays
        )
        if results.final_population is not None:
            remap_parents_of_runs(results.final_population.origin, parents)
        self.parents[self._rows, self.n_generations] = parents

    def _make_offspring_of_species(
        self,
        settings: BaseExperiment,
        keys: RunKeys,
        results: LifeResults,
        lifetimes: Lifetimes,
        fitness_of_runs: Fitness,
    ) -> None:
        """Make the next generation of populations with several species."""
        assert self.species is not None
        children = np.empty_like(self.genomes)
        species = np.empty_like(self.species)
        for rows in self._group_rows():
            arrays = self._select_species_arrays(rows)
            lifetimes_of_group = map_arrays(lifetimes, itemgetter(rows))
            learned = None if results.learned is None else results.learned[rows]
            inherited = inherit_within_species(settings, lifetimes_of_group, learned, arrays)
            offspring = make_offspring(
                self.experiment,
                keys._replace(runs=keys.runs[rows]),
                inherited,
                fitness_of_runs[rows],
                lifetimes_of_group,
                arrays,
            )
            children[rows] = offspring.genome
            species[rows] = offspring.species
            self.parents[self.active[rows], self.n_generations] = offspring.parents
        self.genomes = children
        self.species = species

    def _require_expected_fitness(self, generation: int, fitness_of_runs: Fitness) -> None:
        """Raise RefusedError if the last generation of the records has another fitness now."""
        expected = self._expected_fitness
        # Only the first simulated generation is in the records.
        self._expected_fitness = None
        if expected is None:
            return
        for run, before, after in zip(self.runs, expected, fitness_of_runs, strict=True):
            if not np.array_equal(before, after):
                raise RefusedError(
                    f"run {run} of {self.experiment.name} cannot be continued: generation "
                    f"{generation} gives other results than those that are stored. Use the version "
                    "of baldwinlab and of the parts that made the study"
                )


def read_run_arrays(record: xr.Dataset) -> SpeciesArrays:
    """Return the arrays of a run before the last generation of the record, by species and key."""
    arrays_of_species: SpeciesArrays = {}
    for name in map(str, record.data_vars):
        if name.startswith(variables.RUN_ARRAY_PREFIX):
            species, _, key = name.removeprefix(variables.RUN_ARRAY_PREFIX).partition(".")
            arrays = arrays_of_species.setdefault(int(species), {})
            # `astype` makes a writable copy in the byte order of this machine.
            values = record[name].values
            arrays[key] = values.astype(values.dtype.newbyteorder("="))
    return arrays_of_species


def _select_population(results: LifeResults, rows: npt.NDArray[np.bool_]) -> LifeResults:
    """Return results with the learned weights and the final populations of some rows."""
    population = results.final_population
    if population is not None:
        population = FinalPopulation(population.genome[rows], population.origin[rows])
    learned = None if results.learned is None else results.learned[rows]
    return results._replace(learned=learned, final_population=population)


class History:
    """The recorded variables of one run of a batch."""

    def __init__(self, batch: Histories, index: int) -> None:
        self.batch = batch
        self.experiment = batch.experiment
        self.seed = batch.seed
        self.run = int(batch.runs[index])
        self._index = index

    @property
    def n_generations(self) -> int:
        """Number of simulated generations."""
        return int(self.batch.generation_counts[self._index])

    @property
    def is_stopped(self) -> bool:
        """Whether the part `evolution.stop` has ended the run."""
        return bool(self.batch.is_stopped[self._index])

    @property
    def is_complete(self) -> bool:
        """Whether the run has ended, at its last generation or before."""
        return self.is_stopped or self.n_generations == self.experiment.evolution.generations

    @property
    def recorded_names(self) -> list[str]:
        """Names of the recorded variables, in the order of their first values."""
        return list(self.batch.records)

    def recorded_values(self, name: str) -> npt.NDArray[Any]:
        """Return a recorded variable, [generation, agent], of the simulated generations."""
        return self.batch.records[name][self._index, : self.n_generations]

    @property
    def energy(self) -> npt.NDArray[np.float64]:
        """Fitness, [generation, agent], of the simulated generations."""
        return self.batch.fitness[self._index, : self.n_generations]

    @property
    def parents(self) -> npt.NDArray[np.int32]:
        """Parents, [generation, agent, parent], of the simulated generations."""
        return self.batch.parents[self._index, : self.n_generations]

    @property
    def saved_genomes(self) -> Mapping[int, Genome]:
        """Saved genomes, [agent, module, weight], by generation."""
        # Copy the dictionary at once: another thread may add a generation.
        return {
            generation: saved.genomes[saved.rows[self._index]]
            for generation, saved in self.batch.saved_genomes.copy().items()
            if saved.rows[self._index] != NO_ROW
        }

    def saved_genomes_until(self, generation: int) -> tuple[int, Genome]:
        """Return number and genomes of the last saved generation, at most `generation`."""
        saved = self.saved_genomes
        last_saved = max(candidate for candidate in saved if candidate <= generation)
        return last_saved, saved[last_saved]

    @property
    def last_genome(self) -> Genome:
        """Genomes of the last simulated generation, [agent, module, weight]."""
        return self.saved_genomes[self.n_generations - 1]

    @property
    def stored_run_arrays(self) -> SpeciesArrays:
        """Arrays of the run from before the last generation, by species."""
        return self.batch.run_arrays_before[self._index]
