"""Any lifetime again, step by step: it is recomputed from the seed, not stored."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab import variables
from baldwinlab.errors import RefusedError
from baldwinlab.evolution import Genome, Moment, draw_genome, next_genome
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.cpu import Block
from baldwinlab.models.miniworld.state import HEADING_COUNT
from baldwinlab.runs.simulate import check_seed, facts, simulate_block


def replay(
    experiment: Experiment, *, seed: int = 0, run: int = 0, generation: int = 0, energy: xr.DataArray | None = None
) -> xr.Dataset:
    """One lifetime of a run, every step: the variables of `baldwinlab.variables.TRACE`.

    `energy` (generation, agent) of the same run, where it is at hand, spares living through the generations before. The
    trace agrees to the bit with `simulate` of the same experiment, seed and run.
    Raises RefusedError for a generation that the experiment has not.
    """
    check_seed(seed, run)
    if not 0 <= generation < experiment.evolution.generations:
        raise RefusedError(f"generation = {generation} must be at least 0 and less than {experiment.evolution.generations}")
    genome = genome_at(experiment, Moment(seed, run, generation), energy)
    block = Block(experiment, seed, [run])
    block.begin(generation, genome[None])
    arrays = _record(experiment, block)
    arrays["weight_birth"] = genome
    arrays["weight_death"] = genome.copy()
    arrays["weight_death"][:, 0, : experiment.weight_count] = block.weights()[0]
    attributes = facts(experiment, seed, run) | {"generation": generation}
    found = variables.dataset(variables.TRACE, arrays, attributes)
    return found.assign_coords(side=list(variables.SIDES), module=list(experiment.modules))


def energy_before(experiment: BaseExperiment, moment: Moment) -> xr.DataArray | None:
    """What the generations before `moment` ate, (generation, agent), lived for it; None before the first."""
    seed, run, generation = moment
    if generation == 0:
        return None
    before = {"evolution": {"generations": generation}, "record": {"genome_every": generation}}
    return simulate_block(experiment.replace(**before), seed, [run])[0]["energy"]


def genome_at(experiment: BaseExperiment, moment: Moment, energy: xr.DataArray | None) -> Genome:
    """The genomes [agent, module, weight] of a generation: bred again from what each generation before it ate.

    What is learned cannot be known without living, so with Lamarckian inheritance `energy` is of no use.
    """
    seed, run, generation = moment
    inheritance = experiment.part("evolution.inheritance")
    if inheritance.afresh:
        return draw_genome(experiment, moment)
    if inheritance.wants_learned(experiment) and generation > 0:
        whole = {"evolution": {"generations": generation + 1}, "record": {"genome_every": generation}}
        return np.asarray(simulate_block(experiment.replace(**whole), seed, [run])[0]["genome"].values[generation], np.float32)
    if energy is None:
        energy = energy_before(experiment, moment)
    genome = draw_genome(experiment, Moment(seed, run, 0))
    for earlier in range(generation):
        assert energy is not None
        genome, _ = next_genome(experiment, Moment(seed, run, earlier + 1), genome, energy.values[earlier])
    return genome


def _record(experiment: Experiment, block: Block) -> dict[str, npt.NDArray[Any]]:
    """Live step by step and write down what each step found and did."""
    state, steps, agents = block.state, experiment.lifetime.steps, experiment.population.size
    items = int(block.model.region_items[-1])
    shapes: dict[str, tuple[int, ...]] = {
        "x": (agents,),
        "y": (agents,),
        "heading": (agents,),
        "item_x": (items,),
        "item_y": (items,),
    }
    shapes |= {"sensor": (agents, 3), "output": (agents, 3), "action": (agents,), "eaten": (agents,)}
    arrays = {name: np.empty((steps, *shape), variables.TRACE[name].dtype) for name, shape in shapes.items()}
    eaten_before = np.zeros(agents, np.int64)
    for step in range(steps):
        arrays["x"][step] = state.places[0, :agents]
        arrays["y"][step] = state.places[1, :agents]
        arrays["heading"][step] = state.heading[0, :agents] * (360 / HEADING_COUNT)
        arrays["item_x"][step], arrays["item_y"][step] = block.items()[0].T
        block.live(step, step + 1)
        arrays["sensor"][step] = state.activations[:3, :agents].T
        arrays["output"][step] = state.activations[-3:, :agents].T
        arrays["action"][step] = state.action[0, :agents]
        eaten = state.eaten[:, :agents].sum(axis=0)
        arrays["eaten"][step] = eaten - eaten_before
        eaten_before = eaten
    return arrays
