"""Replay: a lifetime of a run, simulated again from the seed with a trace of every step."""

from __future__ import annotations

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.numbers import check_numbers, require_whole_number
from baldwinlab.core.resources import Need, require_resources
from baldwinlab.core.variables import STOP_ATTRIBUTE
from baldwinlab.evolution import (
    GenerationKey,
    Genome,
    draw_genomes,
    make_founders,
    make_generation,
    needs_simulation,
)
from baldwinlab.evolution.species import SpeciesIndices, list_initial_species
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.species import ACROSS
from baldwinlab.simulation.memory import estimate_replay, estimate_simulation
from baldwinlab.simulation.simulate import simulate_batch
from baldwinlab.simulation.trace import Agents, trace_lifetime


@check_numbers
def replay(
    experiment: Experiment,
    *,
    seed: int = 0,
    run: int = 0,
    generation: int = 0,
    energy: xr.DataArray | None = None,
    world: int = 0,
    force: bool = False,
) -> xr.Dataset:
    """Simulate one lifetime of a run, and record every step.

    The trace is bit-identical to the same lifetime in `simulate`.

    `energy`: fitness [generation, agent] of the same run. With `energy`, earlier generations are
    not simulated. `world`: index of a world of the population. The trace has the agents of this
    world, in the first lifetime. Raises `RefusedError` if the model has no world, if the run stops
    before the generation, or if too little memory is free.
    """
    require_world(experiment)
    require_whole_number("world", world, experiment.population.worlds - 1)
    require_generation(experiment, generation)
    if energy is not None:
        # The energy of the replayed generation itself is not required, therefore + 1.
        require_simulated(experiment, run, generation, count_generations(energy) + 1)
    # The energy of the earlier generations determines the genomes without a simulation.
    n_simulated = generation if energy is None or experiment.population.species else 0
    require_resources(
        f"a lifetime of {experiment.name}",
        _estimate_need(experiment, n_simulated),
        force=force,
    )
    key = GenerationKey(seed, run, generation)
    return trace_lifetime(experiment, recompute_agents(experiment, key, energy), key, world)


@check_numbers
def replay_genomes(
    experiment: BaseExperiment,
    genome: Genome,
    *,
    seed: int = 0,
    run: int = 0,
    generation: int = 0,
    world: int = 0,
    species: SpeciesIndices | None = None,
    force: bool = False,
) -> xr.Dataset:
    """Simulate one lifetime of given genomes, and record every step.

    - `genome`: the genomes of all agents, [agent, module, weight].
    - `seed`, `run`, `generation`: the key of the random numbers, each 0 to 2**31 - 1.
    - `world`: index of a world of the population, from 0.
    - `species`: index of the species of each agent, in ascending order. By default, the species
      have the sizes of the experiment.
    """
    experiment = require_world(experiment)
    require_whole_number("world", world, experiment.population.worlds - 1)
    if experiment.population.species and species is None:
        species = _list_constant_species(experiment)
    key = GenerationKey(seed, run, generation)
    need = _estimate_need(experiment, earlier_generations=0)
    require_resources(f"a lifetime of {experiment.name}", need, force=force)
    return trace_lifetime(experiment, Agents(genome, species), key, world)


def _list_constant_species(experiment: Experiment) -> SpeciesIndices:
    """Return the species of each agent. Raise RefusedError if the sizes of species can change."""
    if experiment.evolution.compete == ACROSS:
        raise RefusedError(
            f"{experiment.name} cannot be replayed from genomes alone: with evolution.compete = "
            "'across', the sizes of the species change; replay a stored study"
        )
    return list_initial_species(experiment)


def require_generation(experiment: BaseExperiment, generation: int) -> None:
    """Raise ArgumentError if an experiment does not have this generation."""
    require_whole_number("generation", generation, experiment.evolution.generations - 1)


def require_world(experiment: BaseExperiment) -> Experiment:
    """Return the experiment. Raise RefusedError if the model has no world."""
    if not isinstance(experiment, Experiment):
        raise RefusedError(
            f"{experiment.name} cannot be replayed: the model {experiment.model} has no world; "
            "only the model miniworld has one"
        )
    return experiment


def _estimate_need(experiment: Experiment, earlier_generations: int) -> Need:
    """Estimate the memory of a replay after the simulation of `earlier_generations`."""
    need = estimate_replay(experiment)
    if not earlier_generations:
        return need
    shortened = experiment.replace(evolution={"generations": earlier_generations})
    return need.add_later(estimate_simulation(shortened))


def count_generations(energy: xr.DataArray) -> int:
    """Return the number of simulated generations: rows of `energy` before the rows of NaN."""
    is_simulated = energy.notnull().any("agent").values
    return len(is_simulated) - int(is_simulated[::-1].argmax())


def require_simulated(
    experiment: BaseExperiment, run: int, generation: int, n_generations: int
) -> None:
    """Raise RefusedError if a run with `n_generations` generations ended before a generation."""
    if generation >= n_generations:
        raise RefusedError(
            f"generation = {generation}: run {run} of {experiment.name} has the generations 0 to "
            f"{n_generations - 1}"
        )


def simulate_energy_before(experiment: BaseExperiment, key: GenerationKey) -> xr.DataArray | None:
    """Simulate the generations before `key`, and return the energy. None for generation 0."""
    seed, run, generation = key
    if generation == 0:
        return None
    shortened = experiment.replace(
        evolution={"generations": generation}, record={"genome_every": generation}
    )
    (dataset,) = simulate_batch(shortened, seed, [run])
    # A complete dataset means that the run has `generation` too, except if the run stopped in
    # generation - 1. Each shorter dataset has the stop attribute.
    n_generations = dataset.sizes["generation"] + (STOP_ATTRIBUTE not in dataset.attrs)
    require_simulated(experiment, run, generation, n_generations)
    return dataset["energy"]


def _simulate_generation(experiment: BaseExperiment, key: GenerationKey) -> xr.Dataset:
    """Simulate a run up to a generation after the first one, and return this generation."""
    seed, run, generation = key
    shortened = experiment.replace(
        evolution={"generations": generation + 1}, record={"genome_every": generation}
    )
    (dataset,) = simulate_batch(shortened, seed, [run])
    require_simulated(experiment, run, generation, dataset.sizes["generation"])
    return dataset.isel(generation=generation)


def recompute_agents(
    experiment: BaseExperiment, key: GenerationKey, energy: xr.DataArray | None = None
) -> Agents:
    """Recompute the genomes and the species of the agents of a generation.

    `energy` (generation, agent): fitness in the earlier generations. If it is None, or if there are
    several species, the earlier generations are simulated.
    """
    if not experiment.population.species:
        return Agents(recompute_genomes(experiment, key, energy), None)
    if key.generation == 0:
        (founders,) = make_founders(experiment, key.as_run_keys())
        return Agents(founders, list_initial_species(experiment))
    dataset = _simulate_generation(experiment, key)
    genome = np.asarray(dataset["genome"].values, np.float32)
    return Agents(genome, dataset["species"].values)


def recompute_genomes(
    experiment: BaseExperiment,
    key: GenerationKey,
    energy: xr.DataArray | None,
    start: tuple[int, Genome] | None = None,
) -> Genome:
    """Recompute the genomes of a generation from the energy of the earlier generations.

    `energy` (generation, agent): fitness in the earlier generations. If it is None, these
    generations are simulated. `start`: a generation and its genomes, from which reproduction starts
    instead of the founders. Returns genomes, [agent, module, weight].

    If inheritance depends on lifetimes, all generations are simulated. `energy` and `start` are
    unused then.
    """
    _, _, generation = key
    has_species = bool(experiment.population.species)
    if not has_species and experiment.part("evolution.inheritance").resamples_genomes:
        return draw_genomes(experiment, key.as_run_keys()).squeeze(0)
    if needs_simulation(experiment) and generation > 0:
        return np.asarray(_simulate_generation(experiment, key)["genome"].values, np.float32)
    if energy is None:
        energy = simulate_energy_before(experiment, key)
    keys = key.as_run_keys()
    first = 0
    if start is None:
        genomes = make_founders(experiment, keys._replace(generation=0))
    else:
        first, genome = start
        genomes = genome[None]
    for earlier in range(first, generation):
        assert energy is not None
        child_keys = keys._replace(generation=earlier + 1)
        # In a dataset of several conditions, NaN follows the agents of a small population.
        fitness = energy.values[None, earlier, : genomes.shape[1]]
        genomes, _ = make_generation(experiment, child_keys, genomes, fitness)
    return genomes.squeeze(0)
