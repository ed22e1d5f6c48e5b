"""History of one run, to which `simulate.py` adds one generation after another."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core import variables
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.records import as_run, select_record
from baldwinlab.evolution import (
    GenerationKey,
    Genome,
    apply_inheritance,
    fitness,
    is_stopped,
    make_founders,
    make_generation,
    mean_fitness,
    remap_parents,
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
from baldwinlab.parts.lifetimes import Lifetimes, lifetimes_of_run
from baldwinlab.parts.model_part import LifeResults
from baldwinlab.simulation.records import make_batch, read_run_arrays

# Index of the parent of an agent without parents.
NO_PARENT = -1


class BranchStart(NamedTuple):
    """First generation to simulate, and the genomes of this generation [agent, module, weight]."""

    generation: int
    genome: Genome


class History:
    """The recorded variables of one run, and the genomes of its next generation.

    `genome`: genomes of the next generation, [agent, module, weight]. `is_stopped`: whether the
    part `evolution.stop` has ended the run.
    """

    def __init__(
        self,
        experiment: BaseExperiment,
        seed: int,
        run: int,
        record: xr.Dataset | None = None,
        start: BranchStart | None = None,
    ) -> None:
        """Begin with the founders, with the last generation of a `record`, or with `start`."""
        self.experiment = experiment
        self.seed = seed
        self.run = run
        self.n_generations = 0
        self.is_stopped = False
        n_generations = experiment.evolution.generations
        n_agents = experiment.population.size
        self._fitness = np.zeros((n_generations, n_agents))
        self._records: dict[str, npt.NDArray[Any]] = {}
        self._parents = np.full((n_generations, n_agents, 2), NO_PARENT, np.int32)
        self._saved_genomes: dict[int, Genome] = {}
        # [agent]: species in the next generation. None for an experiment without species.
        self.species: SpeciesIndices | None = None
        if experiment.population.species:
            self.species = list_initial_species(experiment)
        # Arrays that parts keep during a run, by species (0 without species), and copies of these
        # arrays from before the last generation. `_restore` needs the copies.
        self._run_arrays: SpeciesArrays = {}
        self._run_arrays_before: SpeciesArrays = {}
        # [agent]: stored fitness of the last generation of the record, which is simulated again.
        self._expected_fitness: npt.NDArray[np.float64] | None = None
        if record is not None:
            self._restore(record)
        elif start is not None:
            self.n_generations, self.genome = start
        else:
            self.genome = make_founders(experiment, GenerationKey(seed, run, 0))

    def _restore(self, record: xr.Dataset) -> None:
        """Copy all generations of a record except the last, which is simulated again.

        The next generation can depend on the learned weights of the last generation, and on agents
        that were born during a lifetime. A record contains neither.
        """
        last_generation = record.sizes["generation"] - 1
        declared = variables.record_variables(self.experiment)
        # The order of variables stays that of an uninterrupted run, so that files have equal bytes.
        for name in map(str, record.data_vars):
            if name not in declared or name in variables.COMMON_RECORD_VARIABLES:
                continue
            values = record[name].values
            self._allocate(name, values)[:last_generation] = values[:last_generation]
        self._fitness[:last_generation] = record["energy"].values[:last_generation]
        # The parents of the last generation are known, because selection precedes its simulation.
        self._parents[: last_generation + 1] = record["parents"].values
        saved_generations = record["kept_generation"].values.tolist()
        genomes = record["kept_genome"].values.astype(np.float32)
        self._saved_genomes = dict(zip(saved_generations, genomes, strict=True))
        self.genome = self._saved_genomes.pop(last_generation)
        if self.species is not None:
            self.species = record["species"].values[last_generation].astype(np.int32)
        self._run_arrays = read_run_arrays(record)
        self._expected_fitness = record["energy"].values[last_generation]
        self.n_generations = last_generation

    def _allocate(self, name: str, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the array [generation, agent] of a variable. The first call creates the array.

        `values` [..., agent], or [..., window] for a time series, give the type and the last size.
        """
        if name not in self._records:
            shape = (self.experiment.evolution.generations, values.shape[1])
            self._records[name] = np.zeros(shape, values.dtype)
        return self._records[name]

    @property
    def last_mean_fitness(self) -> float:
        """Mean fitness of the last simulated generation."""
        return float(self._fitness[self.n_generations - 1].mean())

    def add(self, generation: int, results: LifeResults, run_index: int) -> None:
        """Record a generation and make the next one. `run_index`: index of the run in `results`."""
        last_generation = self.experiment.evolution.generations - 1
        settings = self.experiment.at(generation)
        previous = generation - 1
        if previous >= 0 and previous % self.experiment.record.genome_every != 0:
            # The previous genomes were saved only because they were the last genomes until now.
            self._saved_genomes.pop(previous, None)
        self._saved_genomes[generation] = self.genome
        for name, values in results.records.items():
            self._allocate(name, values)[generation] = values[run_index]
        self._record_genes(generation)
        if self.species is not None:
            self._allocate("species", self.species[None])[generation] = self.species
        self._run_arrays_before = {
            index: {name: array.copy() for name, array in arrays.items()}
            for index, arrays in self._run_arrays.items()
        }
        run_arrays = self._run_arrays.setdefault(0, {})
        lifetimes = lifetimes_of_run(settings, results, run_index, self.genome, self.species)
        if self.species is not None:
            self._fitness[generation] = compute_species_fitness(
                settings, lifetimes, self._run_arrays
            )
        elif results.lifetimes:
            self._fitness[generation] = mean_fitness(
                settings, results, run_index, self.genome, run_arrays
            )
        else:
            self._fitness[generation] = fitness(settings, lifetimes, run_arrays)
        self._require_expected_fitness(generation)
        self.is_stopped = is_stopped(
            settings, lifetimes, self._fitness[generation], generation, run_arrays
        )
        if generation < last_generation and not self.is_stopped:
            learned = None if results.learned is None else results.learned[run_index]
            self._make_offspring(settings, lifetimes, learned)
            if self.species is None and results.final_population is not None:
                origin = results.final_population.origin[run_index]
                remap_parents(origin, self._parents[generation + 1])
        self.n_generations = generation + 1

    def _make_offspring(
        self, settings: BaseExperiment, lifetimes: Lifetimes, learned: Genome | None
    ) -> None:
        """Make the next generation."""
        child_generation = self.n_generations + 1
        key = GenerationKey(self.seed, self.run, child_generation)
        fitness_of_parents = self._fitness[self.n_generations]
        if self.species is None:
            run_arrays = self._run_arrays[0]
            inherited = apply_inheritance(settings, lifetimes.genome, learned, run_arrays)
            self.genome, self._parents[child_generation] = make_generation(
                self.experiment, key, inherited, fitness_of_parents, lifetimes, run_arrays
            )
            return
        inherited = inherit_within_species(settings, lifetimes, learned, self._run_arrays)
        offspring = make_offspring(
            self.experiment, key, inherited, fitness_of_parents, lifetimes, self._run_arrays
        )
        self.genome = offspring.genome
        self.species = offspring.species
        self._parents[child_generation] = offspring.parents

    def _record_genes(self, generation: int) -> None:
        """Record the genes of parts by name. A gene is NaN for a species without this gene."""
        names = self.experiment.gene_names
        if not names:
            return
        species = self.species
        groups = [(self.experiment, slice(None))]
        if species is not None:
            members = iterate_members(self.experiment, species)
            groups = [(member.experiment, member.agents) for member in members]
        missing = np.full(len(self.genome), np.nan, np.float32)
        genes = {name: missing.copy() for name in names}
        for experiment, agents in groups:
            for name, values in gene_values(experiment, self.genome[agents]).items():
                genes[name][agents] = values
        for name, values in genes.items():
            # [1, agent], because `_allocate` needs two axes.
            array = self._allocate(variables.gene_variable(name), values[None])
            array[generation] = values

    def _require_expected_fitness(self, generation: int) -> None:
        """Raise RefusedError if the last generation of the record has another fitness now."""
        expected = self._expected_fitness
        # Only the first simulated generation is compared, because the record has no later ones.
        self._expected_fitness = None
        if expected is not None and not np.array_equal(expected, self._fitness[generation]):
            raise RefusedError(
                f"run {self.run} of {self.experiment.name} cannot be continued: generation "
                f"{generation} gives other results than those that are stored. Use the version of "
                "baldwinlab and of the parts that made the study"
            )

    @property
    def is_complete(self) -> bool:
        """Whether the run has ended, at its last generation or before."""
        return self.is_stopped or self.n_generations == self.experiment.evolution.generations

    def recorded_values(self, name: str) -> npt.NDArray[Any]:
        """Return a recorded variable, [generation, agent], of the simulated generations."""
        return self._records[name][: self.n_generations]

    def saved_genomes_until(self, generation: int) -> tuple[int, Genome]:
        """Return the last saved generation up to `generation`, and its genomes."""
        # Iterate over a copy, because another thread can add a generation meanwhile.
        saved = self._saved_genomes.copy()
        last_saved = max(candidate for candidate in saved if candidate <= generation)
        return last_saved, saved[last_saved]

    @property
    def last_genome(self) -> Genome:
        """Genomes of the last simulated generation, [agent, module, weight]."""
        return self._saved_genomes[self.n_generations - 1]

    @property
    def energy(self) -> npt.NDArray[np.float64]:
        """Fitness, [generation, agent], of the simulated generations."""
        return self._fitness[: self.n_generations]

    @property
    def parents(self) -> npt.NDArray[np.int32]:
        """Indices of the parents in the previous generation, [generation, agent, parent]."""
        return self._parents[: self.n_generations]

    def dataset(self) -> xr.Dataset:
        """Return the simulated generations as a dataset. At least one generation is required.

        The dataset is bit-identical to the run of an experiment with this number of generations.
        Copy the dataset if the simulation continues, because it uses the arrays of the history.
        """
        return as_run(self.record())

    def record(self) -> xr.Dataset:
        """Return the run in its stored form, with the variables of `record_variables`."""
        return select_record(make_batch([self]).to_dataset(), 0)

    @property
    def recorded_names(self) -> list[str]:
        """Names of the recorded variables, in the order of their first values."""
        return list(self._records)

    @property
    def saved_genomes(self) -> Mapping[int, Genome]:
        """Saved genomes, [agent, module, weight], by generation."""
        return self._saved_genomes

    @property
    def stored_run_arrays(self) -> SpeciesArrays:
        """Arrays of the run before the last generation, which a continued run simulates again."""
        return self._run_arrays_before
