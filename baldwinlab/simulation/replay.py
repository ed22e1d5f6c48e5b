"""Any lifetime again, step by step: it is recomputed from the seed, not stored."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.core import variables
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.resources import Need, require
from baldwinlab.evolution import (
    GenerationKey,
    Genome,
    draw_genomes,
    make_generation,
    needs_simulation,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.appearance import as_text, look
from baldwinlab.models.miniworld.backends.cpu import Batch
from baldwinlab.models.miniworld.state import HEADING_COUNT
from baldwinlab.simulation.memory import estimate_replay, estimate_simulation
from baldwinlab.simulation.recorder import Series, record_batch
from baldwinlab.simulation.simulate import check_seed, provenance, simulate_batch


def replay(
    experiment: Experiment,
    *,
    seed: int = 0,
    run: int = 0,
    generation: int = 0,
    energy: xr.DataArray | None = None,
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
    force
        Run even if less memory is free than the estimate.

    Returns
    -------
    xarray.Dataset
        The variables of `baldwinlab.core.variables.TRACE`, with the dimensions `step` and `agent`.

    Raises
    ------
    ArgumentError
        The seed or the number of the run is out of range.
    RefusedError
        The model has no world, the experiment has no such generation, or too little memory is free.
    """
    check_seed(seed, run)
    if not isinstance(experiment, Experiment):
        raise RefusedError(
            f"{experiment.name} is of the model {experiment.model}, whose lives have no world to replay"
        )
    if not 0 <= generation < experiment.evolution.generations:
        raise RefusedError(
            f"generation = {generation} must be at least 0 and less than {experiment.evolution.generations}"
        )
    require(
        f"a life of {experiment.name}",
        _need(experiment, 0 if energy is not None else generation),
        force=force,
    )
    genome = recompute_genomes(experiment, GenerationKey(seed, run, generation), energy)
    batch = Batch(experiment, seed, [run])
    batch.begin(generation, genome[None])
    arrays = _record(experiment, batch)
    arrays["weight_birth"] = genome
    arrays["weight_death"] = genome.copy()
    arrays["weight_death"][:, 0, : experiment.weight_count] = batch.weights()[0]
    attributes = provenance(experiment, seed, run) | {
        "generation": generation,
        "look": as_text(experiment),
    }
    found = variables.dataset(variables.of_trace(experiment), arrays, attributes)
    return found.assign_coords(side=list(look(experiment).inputs), module=list(experiment.modules))


def _need(experiment: Experiment, before: int) -> Need:
    """What a replay takes for which so many generations are lived before."""
    need = estimate_replay(experiment)
    return (
        need.then(estimate_simulation(experiment.replace(evolution={"generations": before})))
        if before
        else need
    )


def simulate_energy_before(experiment: BaseExperiment, key: GenerationKey) -> xr.DataArray | None:
    """What the generations before `key` ate, (generation, agent), lived for it; None before the first."""
    seed, run, generation = key
    if generation == 0:
        return None
    before = {"evolution": {"generations": generation}, "record": {"genome_every": generation}}
    return simulate_batch(experiment.replace(**before), seed, [run])[0]["energy"]


def recompute_genomes(
    experiment: BaseExperiment,
    key: GenerationKey,
    energy: xr.DataArray | None,
    known: tuple[int, Genome] | None = None,
) -> Genome:
    """The genomes [agent, module, weight] of a generation: bred again from what each generation before it ate.

    They are bred of the founders, or of an earlier generation whose genomes are `known`. Where who is born, or what is
    inherited, cannot be known without living, neither that nor `energy` is of use.
    """
    seed, run, generation = key
    if experiment.part("evolution.inheritance").resamples_genomes:
        return draw_genomes(experiment, key)
    if needs_simulation(experiment) and generation > 0:
        whole = {
            "evolution": {"generations": generation + 1},
            "record": {"genome_every": generation},
        }
        return np.asarray(
            simulate_batch(experiment.replace(**whole), seed, [run])[0]["genome"].values[
                generation
            ],
            np.float32,
        )
    if energy is None:
        energy = simulate_energy_before(experiment, key)
    first, genome = known or (0, draw_genomes(experiment, GenerationKey(seed, run, 0)))
    for earlier in range(first, generation):
        assert energy is not None
        genome, _ = make_generation(
            experiment, GenerationKey(seed, run, earlier + 1), genome, energy.values[earlier]
        )
    return genome


def _record(experiment: Experiment, batch: Batch) -> dict[str, npt.NDArray[Any]]:
    """Live a life, and write down what each step found and did."""
    agents = slice(experiment.population.size)
    found, done = range(experiment.lifetime.steps), range(1, experiment.lifetime.steps + 1)
    notes = {
        "x": Series("x", found, agents),
        "y": Series("y", found, agents),
        "heading": Series("heading", found, agents),
        "items": Series("items", found, agents),
        "sensor": Series("inputs", done, agents, variables.of_trace(experiment)["sensor"].dtype),
        "output": Series("outputs", done, agents),
        "action": Series("action", done, agents, np.int8),
        "eaten": Series("eaten_in_life", done, agents),
    }
    record_batch(batch, list(notes.values()))
    arrays = {name: note.values for name, note in notes.items()}
    arrays["heading"] *= np.float32(360 / HEADING_COUNT)
    arrays["eaten"] = np.diff(arrays["eaten"], axis=0, prepend=0)
    items = arrays.pop("items")
    return arrays | {"item_x": items[..., 0], "item_y": items[..., 1]}
