"""Simulation of the lifetimes of given genomes in the world of a stored generation.

Birth positions and food depend only on seed, run and generation. Therefore, two lifetimes of agent
i in the same generation are comparable, even with different genomes and settings.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.records import as_record
from baldwinlab.evolution import (
    Fitness,
    GenerationKey,
    Genome,
    make_generation,
    mean_fitness,
    needs_simulation,
    require_fitness_without_archive,
)
from baldwinlab.evolution.genes import trim_genomes
from baldwinlab.evolution.species import count_agents, list_initial_species
from baldwinlab.evolution.species_breeding import compute_species_fitness
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.species import require_single_species
from baldwinlab.models import make_simulator
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.lifetimes import collect_results
from baldwinlab.models.miniworld.world_layout import agents_of_world
from baldwinlab.parts import model_part
from baldwinlab.parts.lifetimes import read_lifetimes
from baldwinlab.simulation.replay import recompute_genomes, require_simulated


class Outcomes(NamedTuple):
    """Results of the agents of several runs in one generation."""

    energy: npt.NDArray[np.float64]  # Fitness, [run, agent].
    weights: npt.NDArray[np.float32]  # Weights of the first module at death, [run, agent, weight].
    # False if the model has no learned weights. `weights` has the weights at birth then.
    has_learned_weights: bool
    records: Mapping[str, npt.NDArray[Any]]  # Recorded variables of the model, [run, agent].


def reevaluate(
    experiment: BaseExperiment, seed: int, runs: Sequence[int], generation: int, genomes: Genome
) -> Outcomes:
    """Simulate complete lifetimes of genomes in the worlds of a stored generation.

    `genomes`: [run, agent, module, weight]. Modules that the experiment does not use are ignored.
    Raises `RefusedError` if the fitness depends on the earlier generations of a run, or if there
    are several species.
    """
    require_fitness_without_archive(experiment, "another simulation of stored agents")
    genomes = trim_genomes(genomes, experiment)
    require_single_species(experiment, "another simulation of stored agents")
    results = make_simulator(experiment, seed, runs).simulate(generation, genomes)
    settings = experiment.at(generation)
    return _make_outcomes(settings, results, genomes)


def reevaluate_species(
    experiment: BaseExperiment, seed: int, runs: Sequence[int], generation: int, genomes: Genome
) -> Fitness:
    """Simulate complete lifetimes of genomes of several species in the worlds of a generation.

    `genomes`: [run, agent, module, weight], all agents of species 0 first. Returns the fitness
    [run, agent] by the fitness part of each species. Raises `RefusedError` if the fitness depends
    on the earlier generations of a run.
    """
    require_fitness_without_archive(experiment, "another simulation of stored agents")
    species = list_initial_species(experiment)
    sizes = count_agents(species, len(experiment.population.species))
    sizes_of_runs = np.tile(sizes, (len(runs), 1))
    simulator = make_simulator(experiment, seed, runs)
    results = simulator.simulate(generation, genomes, sizes_of_runs)
    settings = experiment.at(generation)
    lifetimes = read_lifetimes(settings, results, genomes, np.tile(species, (len(runs), 1)))
    return compute_species_fitness(settings, lifetimes)


def make_batch(
    experiment: Experiment,
    seed: int,
    runs: Sequence[int],
    generation: int,
    genomes: Genome,
    *,
    world: int | None = None,
) -> CpuBatch:
    """Return a batch of genomes [run, agent, module, weight] before the first step.

    With `world`, the batch has only this world of each population, in the first lifetime.
    """
    settings = experiment.at(generation)
    if world is not None:
        genomes = genomes[:, agents_of_world(settings, world)]
    batch = CpuBatch(settings, seed, runs, world)
    batch.begin(generation, trim_genomes(genomes, settings))
    return batch


def collect_outcomes(experiment: Experiment, batch: CpuBatch, genomes: Genome) -> Outcomes:
    """Return the results of a batch that began with `genomes` [run, agent, module, weight]."""
    return _make_outcomes(experiment, collect_results(experiment, batch, genomes), genomes)


def _make_outcomes(
    experiment: BaseExperiment, results: model_part.LifeResults, genomes: Genome
) -> Outcomes:
    first_module = genomes[:, :, 0, : experiment.weight_count]
    return Outcomes(
        energy=mean_fitness(experiment, results, genomes),
        weights=first_module if results.learned is None else results.learned,
        has_learned_weights=results.learned is not None,
        records=results.records,
    )


def restore_genomes(experiment: BaseExperiment, record: xr.Dataset, generation: int) -> Genome:
    """Return the genomes of a generation of a stored run, [agent, module, weight].

    If the genomes are not stored, they are recomputed from the previous stored generation. Raises
    `RefusedError` if the run stopped before the generation.
    """
    record = as_record(record)
    require_simulated(experiment, int(record.attrs["run"]), generation, record.sizes["generation"])
    stored_generations = record["kept_generation"].values
    # The founders are always stored, so a previous stored generation exists.
    stored_index = int(np.searchsorted(stored_generations, generation, side="right")) - 1
    stored_generation = int(stored_generations[stored_index])
    stored_genomes = np.asarray(record["kept_genome"].values[stored_index], np.float32)
    if stored_generation == generation:
        return stored_genomes
    return recompute_genomes(
        experiment,
        _key_of_record(record, generation),
        record.energy,
        start=(stored_generation, stored_genomes),
    )


def _key_of_record(record: xr.Dataset, generation: int) -> GenerationKey:
    """Return the key of a generation of a stored run."""
    return GenerationKey(int(record.attrs["seed"]), int(record.attrs["run"]), generation)


def iterate_genomes(experiment: BaseExperiment, record: xr.Dataset) -> Iterator[Genome]:
    """Yield the genomes of each generation of a stored run. Recompute genomes that are missing."""
    record = as_record(record)
    genome = restore_genomes(experiment, record, 0)
    stored_generations = set(record["kept_generation"].values.tolist())
    for generation in range(record.sizes["generation"]):
        # If genomes depend on lifetimes, `restore_genomes` simulates the earlier generations again.
        if generation in stored_generations or needs_simulation(experiment):
            genome = restore_genomes(experiment, record, generation)
        else:
            genomes, _ = make_generation(
                experiment,
                _key_of_record(record, generation).as_run_keys(),
                genome[None],
                fitness=record.energy.values[None, generation - 1],
            )
            (genome,) = genomes
        yield genome
