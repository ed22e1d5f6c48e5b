"""The lifetime that a request names, and the data that a new simulation of this lifetime needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.evolution import GenerationKey, Genome
from baldwinlab.evolution.species import SpeciesIndices
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.lab import Lab, MissingError, Query, read_number, read_text
from baldwinlab.lab.sources import studies
from baldwinlab.lab.sources.presets import load_preset
from baldwinlab.simulation.history import History
from baldwinlab.simulation.reevaluation import restore_genomes
from baldwinlab.simulation.replay import (
    recompute_genomes,
    require_simulated,
    simulate_energy_before,
)
from baldwinlab.simulation.simulate import check_seed, simulate_histories

MAX_RESPONSE_STEPS = 20_000
# The size of a response is estimated, so a response can be slightly larger.
MAX_RESPONSE_BYTES = 32 * 2**20


class StartData(NamedTuple):
    """The data that a lifetime starts with, and the known history of its run."""

    genomes: Genome  # The genomes at birth [agent, module, weight].
    # The fitness in all earlier generations [generation, agent], and in later generations if they
    # are known. None in generation 0 of a preset without species.
    fitness: xr.DataArray | None
    # The parents in all known generations [generation, agent, parent]. None for a live run or a
    # preset without species.
    parents: xr.DataArray | None = None
    # The species of each agent [agent]. None without species.
    species: SpeciesIndices | None = None


class Life(NamedTuple):
    """One lifetime. The experiment and the key determine it completely."""

    experiment: Experiment
    key: GenerationKey  # Seed, run and generation.
    # Reads or computes the start data, which can take seconds.
    load_start_data: Callable[[], StartData]


class Span(NamedTuple):
    """The steps from `first` up to, but not including, `stop`."""

    first: int
    stop: int

    def make_header(self) -> dict[str, int]:
        """Return the entries for the header of a container. `last` is `stop`."""
        return {"first": self.first, "last": self.stop}


def load_container(
    lab: Lab,
    kind: str,
    query: Query,
    estimate_bytes_per_step: Callable[[Experiment], int],
    make: Callable[[Life, Span], bytes],
) -> bytes:
    """Return the container of the requested steps of a lifetime, from the cache or from `make`."""
    life = find_life(lab, query)
    n_steps = life.experiment.lifetime.steps
    span = read_span(query, n_steps, estimate_bytes_per_step(life.experiment))
    cache_key = (kind, tuple(sorted(query.items())), life.experiment, life.key)
    return lab.cache.get(cache_key, lambda: make(life, span))


def read_span(query: Query, n_steps: int, bytes_per_step: int) -> Span:
    """Return the requested steps of a lifetime (default: all), limited to one response."""
    first = read_number(query, "first", 0)
    stop = read_number(query, "last", n_steps)
    if not first < stop <= n_steps:
        raise ValueError(
            f"first = {first} and last = {stop} must be in order and at most {n_steps}, the number"
            " of steps of a lifetime"
        )
    # A response contains at least one step.
    max_steps = max(1, min(MAX_RESPONSE_STEPS, MAX_RESPONSE_BYTES // bytes_per_step))
    return Span(first, min(stop, first + max_steps))


def find_life(lab: Lab, query: Query) -> Life:
    """Return the lifetime that a query names. Raise MissingError for a model without a world.

    The parameters of the query are `run`, `generation`, and either `study` and `condition`, or
    `live`, or `preset` and `seed`.
    """
    life = find_life_of_any_model(lab, query)
    if not isinstance(life.experiment, Experiment):
        raise MissingError(
            f"{life.experiment.name} has no world to show: its model is {life.experiment.model}"
        )
    return life


def require_agent(experiment: BaseExperiment, agent: int) -> None:
    """Raise MissingError if the population does not have this agent."""
    if agent >= experiment.population.size:
        last_agent = experiment.population.size - 1
        raise MissingError(
            f"{experiment.name} has no agent {agent}: its agents are 0 to {last_agent}"
        )


def require_generation(experiment: BaseExperiment, generation: int) -> None:
    """Raise MissingError if the experiment does not have this generation."""
    if generation >= experiment.evolution.generations:
        last_generation = experiment.evolution.generations - 1
        raise MissingError(
            f"{experiment.name} has no generation {generation}: "
            f"its generations are 0 to {last_generation}"
        )


def find_life_of_any_model(lab: Lab, query: Query) -> Life:
    """Return the lifetime that a query names, as `find_life`. The model may have no world."""
    generation = read_number(query, "generation")
    if "study" in query:
        return _find_stored_life(lab, query, generation)
    if "live" in query:
        run = read_number(query, "run")
        live_run = lab.live.find_run(query["live"])
        fitness = live_run.read_fitness(run, generation)
        key = GenerationKey(live_run.seed, run, generation)
        if live_run.experiment.population.species:
            genomes = live_run.read_genomes(run, generation)
            history = live_run.find_history(run, generation)
            return Life(
                live_run.experiment, key, lambda: _read_history(history, generation, genomes)
            )
        return _make_recomputed_life(live_run.experiment, key, lambda: fitness)
    key = GenerationKey(
        seed=read_number(query, "seed", 0), run=read_number(query, "run", 0), generation=generation
    )
    check_seed(key.seed, key.run)
    experiment = load_preset(read_text(query, "preset"))
    if experiment.population.species:
        require_generation(experiment, generation)
        return Life(experiment, key, lambda: simulate_species(experiment, key))
    return _make_recomputed_life(experiment, key, lambda: simulate_energy_before(experiment, key))


def _find_stored_life(lab: Lab, query: Query, generation: int) -> Life:
    study, experiment, run = studies.find_run(lab, query)
    study.require_parts(experiment.name)
    require_generation(experiment, generation)

    def load_start_data() -> StartData:
        record = study.record(experiment.name, run)
        genomes = restore_genomes(experiment, record, generation)
        species = None
        if experiment.population.species:
            species = record["species"].values[generation].astype(np.int32)
        return StartData(genomes, record.energy, record.parents, species)

    return Life(experiment, GenerationKey(study.seed, run, generation), load_start_data)


def _make_recomputed_life(
    experiment: Experiment, key: GenerationKey, load_fitness: Callable[[], xr.DataArray | None]
) -> Life:
    """Return a lifetime. Its start data computes the genomes from the fitness of earlier ones."""
    require_generation(experiment, key.generation)

    def load_start_data() -> StartData:
        fitness = load_fitness()
        genomes = recompute_genomes(experiment, key, fitness)
        return StartData(genomes, fitness=fitness)

    return Life(experiment, key, load_start_data)


def simulate_until(experiment: Experiment, key: GenerationKey) -> History:
    """Simulate a run up to and including a generation."""
    n_generations = key.generation + 1
    # `genome_every`: the history saves only the genomes of the first and the last generation.
    shortened = experiment.replace(
        evolution={"generations": n_generations}, record={"genome_every": n_generations}
    )
    (history,) = simulate_histories(shortened, key.seed, [key.run])
    return history


def simulate_species(experiment: Experiment, key: GenerationKey) -> StartData:
    """Simulate a run with species up to a generation, and return the generation's start data."""
    history = simulate_until(experiment, key)
    require_simulated(experiment, key.run, key.generation, history.n_generations)
    return _read_history(history, key.generation, history.last_genome)


def _read_history(history: History, generation: int, genomes: Genome) -> StartData:
    """Return the start data of a generation of a run with species."""
    return StartData(
        genomes,
        fitness=xr.DataArray(history.energy, dims=("generation", "agent")),
        parents=xr.DataArray(history.parents, dims=("generation", "agent", "parent")),
        species=history.recorded_values("species")[generation],
    )
