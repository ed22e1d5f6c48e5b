"""Replay: a lifetime of a run, recomputed from its seed with a record of every step."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.core import variables
from baldwinlab.core.errors import ArgumentError, RefusedError
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
from baldwinlab.evolution.genes import trim_genomes
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.species import require_single_species
from baldwinlab.models.miniworld.appearance import appearance_json, describe_appearance
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.state import HEADING_COUNT
from baldwinlab.models.miniworld.world_layout import agents_of_world
from baldwinlab.simulation.history import provenance_attributes
from baldwinlab.simulation.memory import estimate_replay, estimate_simulation
from baldwinlab.simulation.recorder import Series, record_batch
from baldwinlab.simulation.simulate import check_seed, simulate_batch

DEGREES_PER_TURN = 360


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

    Parameters
    ----------
    experiment
        The settings.
    seed
        Seed of all random numbers, 0 to 2**31 - 1.
    run
        Number of the run, 0 to 2**31 - 1.
    generation
        Number of the generation, from 0.
    energy
        Array (generation, agent) of the same run. With it, earlier generations are not simulated.
    world
        Number of a world of the population, from 0. The trace has the agents of this world, in the
        first of their lifetimes.
    force
        Run even if less memory is free than the estimate.

    Returns
    -------
    xarray.Dataset
        The variables of `baldwinlab.core.variables.TRACE_VARIABLES`, with the dimensions `step` and
        `agent`. With several worlds, the coordinate `agent` has the numbers of the agents in the
        population.

    Raises
    ------
    ArgumentError
        The seed or the number of the run or of the world is out of range.
    RefusedError
        The model has no world, the experiment has no such generation, the run stops before it, or
        too little memory is free.
    """
    check_seed(seed, run)
    _require_world_number(require_world(experiment), world)
    if not 0 <= generation < experiment.evolution.generations:
        raise RefusedError(
            f"generation = {generation} must be at least 0 and less than "
            f"{experiment.evolution.generations}"
        )
    if energy is not None:
        # The energy of the replayed generation is not required.
        require_simulated(experiment, run, generation, count_generations(energy) + 1)
    # The energy of the earlier generations determines the genomes without a simulation.
    n_simulated = generation if energy is None else 0
    require_resources(
        f"a lifetime of {experiment.name}",
        _estimate_need(experiment, n_simulated),
        force=force,
    )
    key = GenerationKey(seed, run, generation)
    genome = recompute_genomes(experiment, key, energy)
    return _trace_lifetime(experiment, genome, key, world)


def replay_genomes(
    experiment: BaseExperiment,
    genome: Genome,
    *,
    seed: int = 0,
    run: int = 0,
    generation: int = 0,
    world: int = 0,
    force: bool = False,
) -> xr.Dataset:
    """Simulate one lifetime of given genomes, and record every step.

    Parameters
    ----------
    experiment
        The settings.
    genome
        The genomes of all agents, [agent, module, weight].
    seed, run, generation
        The key of the random numbers, each 0 to 2**31 - 1.
    world
        Number of a world of the population, from 0.
    force
        Run even if less memory is free than the estimate.

    Returns
    -------
    xarray.Dataset
        The trace, as of `replay`.

    Raises
    ------
    ArgumentError
        The seed or the number of the run, of the generation or of the world is out of range.
    RefusedError
        The model has no world, or too little memory is free.
    """
    check_seed(seed, run)
    check_seed(generation)
    experiment = require_world(experiment)
    _require_world_number(experiment, world)
    key = GenerationKey(seed, run, generation)
    need = _estimate_need(experiment, earlier_generations=0)
    require_resources(f"a lifetime of {experiment.name}", need, force=force)
    return _trace_lifetime(experiment, genome, key, world)


def _require_world_number(experiment: Experiment, world: int) -> None:
    """Raise ArgumentError if a population does not have this world."""
    last = experiment.population.worlds - 1
    if not 0 <= world <= last:
        raise ArgumentError("world", world, f"must be a whole number from 0 to {last}")


def require_world(experiment: BaseExperiment) -> Experiment:
    """Return an experiment whose model has a world.

    Parameters
    ----------
    experiment
        The experiment.

    Raises
    ------
    RefusedError
        Its model has no world, or its population has several species.
    """
    if not isinstance(experiment, Experiment):
        raise RefusedError(
            f"{experiment.name} cannot be replayed: the model {experiment.model} has no world; "
            "only the model miniworld has one"
        )
    require_single_species(experiment, "a replay")
    return experiment


def _trace_lifetime(
    experiment: Experiment, genome: Genome, key: GenerationKey, world: int
) -> xr.Dataset:
    """Simulate one world of the population `genome` [agent, module, weight], return its trace."""
    seed, run, generation = key
    settings = experiment.at(generation)
    agents = agents_of_world(settings, world)
    genome = trim_genomes(genome[agents], settings)
    batch = CpuBatch(settings, seed, [run], world=world)
    genomes_of_batch = genome[None]
    batch.begin(generation, genomes_of_batch)
    arrays = _record_steps(settings, batch)
    # Only the action module, which is module 0, can change. The batch has one run.
    (action_weights,) = batch.weights()
    genome_at_death = genome.copy()
    genome_at_death[:, 0, : settings.weight_count] = action_weights
    arrays["weight_birth"] = genome
    arrays["weight_death"] = genome_at_death
    attributes = provenance_attributes(experiment, seed, run) | {
        "generation": generation,
        "appearance": appearance_json(settings),
    }
    trace = variables.make_dataset(variables.trace_variables(settings), arrays, attributes)
    trace = trace.assign_coords(
        side=list(describe_appearance(settings).inputs), module=list(settings.modules)
    )
    if settings.population.worlds == 1:
        return trace
    agent_numbers = np.arange(agents.start, agents.stop, dtype=np.int32)
    return trace.assign_coords(agent=agent_numbers).assign_attrs(world=world)


def _estimate_need(experiment: Experiment, earlier_generations: int) -> Need:
    """Estimate the memory of a replay after the simulation of `earlier_generations`."""
    need = estimate_replay(experiment)
    if not earlier_generations:
        return need
    shortened = experiment.replace(evolution={"generations": earlier_generations})
    return need.add_later(estimate_simulation(shortened))


def count_generations(energy: xr.DataArray) -> int:
    """Return the number of simulated generations of a run with the energy (generation, agent)."""
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
    """Simulate the generations before `key`, and return their energy; None for the founders."""
    seed, run, generation = key
    if generation == 0:
        return None
    shortened = experiment.replace(
        evolution={"generations": generation}, record={"genome_every": generation}
    )
    (dataset,) = simulate_batch(shortened, seed, [run])
    # A run that stopped has no later generation, even if its last one is the one before.
    n_generations = dataset.sizes["generation"] + (STOP_ATTRIBUTE not in dataset.attrs)
    require_simulated(experiment, run, generation, n_generations)
    return dataset["energy"]


def recompute_genomes(
    experiment: BaseExperiment,
    key: GenerationKey,
    energy: xr.DataArray | None,
    start: tuple[int, Genome] | None = None,
) -> Genome:
    """Recompute the genomes of a generation from the energy of the earlier generations.

    Parameters
    ----------
    experiment : BaseExperiment
        The settings.
    key : GenerationKey
        The run and the generation.
    energy : xarray.DataArray or None
        Energy (generation, agent) of the earlier generations. If None, they are simulated.
    start : tuple of int and Genome, optional
        A generation and its genomes, from which reproduction starts instead of the founders.

    Returns
    -------
    Genome
        Genomes, [agent, module, weight].

    Notes
    -----
    If inheritance depends on lifetimes, all generations are simulated.
    Then `energy` and `start` are unused.
    """
    seed, run, generation = key
    has_species = bool(experiment.population.species)
    if not has_species and experiment.part("evolution.inheritance").resamples_genomes:
        return draw_genomes(experiment, key)
    if needs_simulation(experiment) and generation > 0:
        shortened = experiment.replace(
            evolution={"generations": generation + 1}, record={"genome_every": generation}
        )
        (dataset,) = simulate_batch(shortened, seed, [run])
        require_simulated(experiment, run, generation, dataset.sizes["generation"])
        return np.asarray(dataset["genome"].values[generation], np.float32)
    if energy is None:
        energy = simulate_energy_before(experiment, key)
    founder_key = key._replace(generation=0)
    first, genome = start or (0, make_founders(experiment, founder_key))
    for earlier in range(first, generation):
        assert energy is not None
        child_key = key._replace(generation=earlier + 1)
        genome, _ = make_generation(experiment, child_key, genome, fitness=energy.values[earlier])
    return genome


def _record_steps(experiment: Experiment, batch: CpuBatch) -> dict[str, npt.NDArray[Any]]:
    """Simulate a lifetime and return the recorded arrays, [step, ...]."""
    agents = slice(experiment.agents_per_world)
    steps = experiment.lifetime.steps
    # Positions are read before a step. Inputs, outputs and results are read after the step.
    times_before = range(steps)
    times_after = range(1, steps + 1)
    recorders = {
        "x": Series("x", times_before, agents),
        "y": Series("y", times_before, agents),
        "heading": Series("heading", times_before, agents),
        "items": Series("items", times_before, agents),
        "sensor": Series(
            "inputs", times_after, agents, variables.trace_variables(experiment)["sensor"].dtype
        ),
        "output": Series("outputs", times_after, agents),
        "action": Series("action", times_after, agents, np.int8),
        "eaten": Series("eaten_in_life", times_after, agents),
    }
    record_batch(batch, list(recorders.values()))
    arrays = {name: recorder.values for name, recorder in recorders.items()}
    arrays["heading"] *= np.float32(DEGREES_PER_TURN / HEADING_COUNT)
    # From the number of items in life to the number in each step.
    arrays["eaten"] = np.diff(arrays["eaten"], axis=0, prepend=0)
    item_positions = arrays.pop("items")
    return arrays | {"item_x": item_positions[..., 0], "item_y": item_positions[..., 1]}
