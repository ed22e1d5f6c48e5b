"""The functions of evolution for one run, which call those of the package with one run."""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab import evolution
from baldwinlab.evolution import (
    Fitness,
    GenerationKey,
    Genome,
    Parents,
    Uniforms,
    breeding,
    species_breeding,
)
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts.breeding import RunArrays
from baldwinlab.parts.lifetimes import Lifetimes, add_run_dimension, map_arrays, read_lifetimes
from baldwinlab.parts.model_part import LifeResults

FIRST_KEY = GenerationKey(seed=0, run=0, generation=0)


def take_run(lifetimes: Lifetimes, run: int) -> Lifetimes:
    """Return the lifetimes of one run of a batch."""
    return map_arrays(lifetimes, lambda values: values[run])


def lifetimes_of_run(
    experiment: BaseExperiment, results: LifeResults, run: int, genome: Genome
) -> Lifetimes:
    """Return the lifetimes of one run from the results of a batch."""
    genomes = np.zeros((len(results.energy), *genome.shape), np.float32)
    genomes[run] = genome
    return take_run(read_lifetimes(experiment, results, genomes), run)


def select_lifetimes(lifetimes: Lifetimes, agents: slice) -> Lifetimes:
    """Return the lifetimes of some agents of a run."""
    return map_arrays(lifetimes, lambda values: values[agents])


def _add_run(value: Any) -> Any:
    """Return a batch of one run: of lifetimes, of an array, or of the arrays of a run."""
    if isinstance(value, Lifetimes):
        return add_run_dimension(value)
    if isinstance(value, np.ndarray):
        return value[None]
    return None if value is None else [value]


def make_founders(experiment: BaseExperiment, key: GenerationKey) -> Genome:
    return evolution.make_founders(experiment, key.as_run_keys()).squeeze(0)


def draw_genomes(experiment: BaseExperiment, key: GenerationKey) -> Genome:
    return evolution.draw_genomes(experiment, key.as_run_keys()).squeeze(0)


def fitness(
    experiment: BaseExperiment, lifetimes: Lifetimes, run_arrays: RunArrays | None = None
) -> Fitness:
    values = evolution.fitness(experiment, add_run_dimension(lifetimes), _add_run(run_arrays))
    return values.squeeze(0)


def is_stopped(
    experiment: BaseExperiment,
    lifetimes: Lifetimes,
    fitness: Fitness,
    generation: int,
    run_arrays: RunArrays | None = None,
) -> bool:
    stopped = evolution.find_stopped_runs(
        experiment, add_run_dimension(lifetimes), fitness[None], generation, _add_run(run_arrays)
    )
    return bool(stopped[0])


def apply_inheritance(
    experiment: BaseExperiment,
    genome: Genome,
    learned: Genome | None,
    run_arrays: RunArrays | None = None,
) -> Genome:
    return evolution.apply_inheritance(
        experiment, genome[None], _add_run(learned), _add_run(run_arrays)
    ).squeeze(0)


def select(
    experiment: BaseExperiment,
    fitness: Fitness,
    uniforms: Uniforms,
    lifetimes: Lifetimes | None = None,
    key: GenerationKey = FIRST_KEY,
    run_arrays: RunArrays | None = None,
) -> Parents:
    keys = key.as_run_keys()
    return evolution.select(
        experiment, keys, fitness[None], uniforms[None], _add_run(lifetimes), _add_run(run_arrays)
    ).squeeze(0)


def breed(
    experiment: BaseExperiment,
    genome: Genome,
    fitness: Fitness,
    key: GenerationKey,
    lifetimes: Lifetimes | None = None,
    run_arrays: RunArrays | None = None,
) -> tuple[Genome, Parents]:
    children, parents = evolution.breed(
        experiment,
        key.as_run_keys(),
        genome[None],
        fitness[None],
        _add_run(lifetimes),
        _add_run(run_arrays),
    )
    return children.squeeze(0), parents.squeeze(0)


def make_generation(
    experiment: BaseExperiment,
    key: GenerationKey,
    genome: Genome,
    fitness: Fitness,
    lifetimes: Lifetimes | None = None,
    run_arrays: RunArrays | None = None,
) -> tuple[Genome, Parents]:
    children, parents = evolution.make_generation(
        experiment,
        key.as_run_keys(),
        genome[None],
        fitness[None],
        _add_run(lifetimes),
        _add_run(run_arrays),
    )
    return children.squeeze(0), parents.squeeze(0)


def make_children(
    experiment: BaseExperiment,
    key: GenerationKey,
    genome: Genome,
    fitness: Fitness,
    parents: Parents,
) -> Genome:
    keys = key.as_run_keys()
    return breeding.make_children(
        experiment, keys, genome[None], fitness[None], parents[None]
    ).squeeze(0)


def compute_species_fitness(
    experiment: BaseExperiment, lifetimes: Lifetimes, arrays: Any = None
) -> Fitness:
    batch = add_run_dimension(lifetimes)
    return species_breeding.compute_species_fitness(experiment, batch, _add_run(arrays)).squeeze(0)


def inherit_within_species(
    experiment: BaseExperiment, lifetimes: Lifetimes, learned: Genome | None, arrays: Any = None
) -> Genome:
    return species_breeding.inherit_within_species(
        experiment, add_run_dimension(lifetimes), _add_run(learned), _add_run(arrays)
    ).squeeze(0)


def make_offspring(
    experiment: BaseExperiment,
    key: GenerationKey,
    genome: Genome,
    fitness: Fitness,
    lifetimes: Lifetimes,
    arrays: Any = None,
) -> species_breeding.Offspring:
    offspring = species_breeding.make_offspring(
        experiment,
        key.as_run_keys(),
        genome[None],
        fitness[None],
        add_run_dimension(lifetimes),
        _add_run(arrays),
    )
    return species_breeding.Offspring(
        offspring.genome.squeeze(0), offspring.parents.squeeze(0), offspring.species.squeeze(0)
    )
