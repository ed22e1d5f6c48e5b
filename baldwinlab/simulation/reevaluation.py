"""Lives of given genomes among the births and the food of a stored generation: nothing is evolved.

Where an agent is born and where the food lies depend on seed, run and generation alone, so lives of the same generation can be
compared agent by agent, whatever their genomes and whatever their circumstances.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.core.variables import to_storage
from baldwinlab.evolution import GenerationKey, Genome, fitness, make_generation, needs_simulation
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models import make_simulator
from baldwinlab.models.miniworld.backends.cpu import Batch
from baldwinlab.models.miniworld.lifetimes import collect_results
from baldwinlab.parts import model_part
from baldwinlab.simulation.replay import recompute_genomes


class Outcomes(NamedTuple):
    """What became of the agents of several runs at one generation."""

    energy: npt.NDArray[
        np.float64
    ]  # [run, agent], the fitness: of the items eaten, less the cost of learning
    weights: npt.NDArray[np.float32]  # [run, agent, weight], of the first module, at death
    has_learned_weights: bool  # whether they are: of models that do not tell what is learned, the weights are those at birth


def reevaluate(
    experiment: BaseExperiment, seed: int, runs: Sequence[int], generation: int, genomes: Genome
) -> Outcomes:
    """Live whole lives with `genomes` [run, agent, module, weight] in the worlds of these runs at this generation.

    A run's bits do not depend on the others beside it. Of more modules than the experiment's agents have, the first are used.
    """
    genomes = genomes[:, :, : len(experiment.modules)]
    return _make_outcomes(
        experiment, make_simulator(experiment, seed, runs).simulate(generation, genomes), genomes
    )


def make_batch(
    experiment: Experiment, seed: int, runs: Sequence[int], generation: int, genomes: Genome
) -> Batch:
    """The batch in which such lives begin, before their first step."""
    batch = Batch(experiment, seed, runs)
    batch.begin(generation, genomes[:, :, : len(experiment.modules)])
    return batch


def collect_outcomes(experiment: Experiment, batch: Batch, genomes: Genome) -> Outcomes:
    """What has become of the lives in a batch, which began with `genomes` [run, agent, module, weight]."""
    return _make_outcomes(experiment, collect_results(experiment, batch, genomes), genomes)


def _make_outcomes(
    experiment: BaseExperiment, lives: model_part.LifeResults, genomes: Genome
) -> Outcomes:
    worth = [fitness(experiment, *of_run) for of_run in zip(lives.energy, lives.cost, strict=True)]
    unchanged = genomes[:, :, 0, : experiment.weight_count]
    told = lives.learned is not None
    return Outcomes(np.stack(worth), unchanged if lives.learned is None else lives.learned, told)


def stored_genome(experiment: BaseExperiment, record: xr.Dataset, generation: int) -> Genome:
    """The genomes [agent, module, weight] of a generation of a stored run: as kept, or else bred again of the last that were."""
    record = to_storage(record)
    place = (
        int(np.searchsorted(record["kept_generation"].values, generation, side="right")) - 1
    )  # the founders are kept
    last, genome = (
        int(record["kept_generation"].values[place]),
        np.asarray(record["kept_genome"].values[place], np.float32),
    )
    seed, run = (int(record.attrs[name]) for name in ("seed", "run"))
    if last == generation:
        return genome
    return recompute_genomes(
        experiment, GenerationKey(seed, run, generation), record.energy, (last, genome)
    )


def stored_genomes(experiment: BaseExperiment, record: xr.Dataset) -> Iterator[Genome]:
    """Those of every generation of a stored run, one after the other: as `stored_genome`, but each bred of the one before it."""
    seed, run = (int(record.attrs[name]) for name in ("seed", "run"))
    record = to_storage(record)
    genome, kept = (
        stored_genome(experiment, record, 0),
        set(record["kept_generation"].values.tolist()),
    )
    for generation in range(record.sizes["generation"]):
        if generation in kept or needs_simulation(experiment):
            genome = stored_genome(experiment, record, generation)
        else:
            genome, _ = make_generation(
                experiment,
                GenerationKey(seed, run, generation),
                genome,
                record.energy.values[generation - 1],
            )
        yield genome
