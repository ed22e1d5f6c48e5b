"""Trace of a lifetime: the state of every agent and item in every step, as a dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core import variables
from baldwinlab.core.deferred import xr
from baldwinlab.evolution import GenerationKey, Genome
from baldwinlab.evolution.genes import trim_genomes
from baldwinlab.evolution.species import SpeciesIndices, count_agents
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.species import combine_inputs
from baldwinlab.models.miniworld.appearance import appearance_json, describe_appearance
from baldwinlab.models.miniworld.backends.choice import SimulatedAgents
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.species import make_species_batch
from baldwinlab.models.miniworld.state import HEADING_COUNT
from baldwinlab.models.miniworld.world_layout import agents_of_world
from baldwinlab.simulation.recorder import Recorder, Series, SpeciesRecorder, record_batch
from baldwinlab.simulation.records import provenance_attributes

DEGREES_PER_TURN = 360

Arrays = dict[str, npt.NDArray[Any]]


class Agents(NamedTuple):
    """The agents of a generation at birth."""

    genome: Genome  # [agent, module, weight]
    # [agent]: index of the species, in ascending order. None for an experiment without species.
    species: SpeciesIndices | None


class RecordedMember(NamedTuple):
    """Agents with equal settings: the settings, the view of the batch, and indices of agents."""

    experiment: Experiment
    view: SimulatedAgents
    agents: slice


def trace_lifetime(
    experiment: Experiment, agents: Agents, key: GenerationKey, world: int
) -> xr.Dataset:
    """Simulate a lifetime in world `world`, and return the trace of its agents."""
    seed, run, generation = key
    settings = experiment.at(generation)
    agents_in_world = agents_of_world(settings, world)
    genome = trim_genomes(agents.genome[agents_in_world], settings)
    members = begin_lifetime(settings, agents, key, world)
    arrays = _record_steps(settings, members)
    arrays["weight_birth"] = genome
    arrays["weight_death"] = _collect_weights(genome, members)
    if agents.species is not None:
        arrays["species"] = agents.species
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
    agent_numbers = np.arange(agents_in_world.start, agents_in_world.stop, dtype=np.int32)
    return trace.assign_coords(agent=agent_numbers).assign_attrs(world=world)


def begin_lifetime(
    settings: Experiment, agents: Agents, key: GenerationKey, world: int
) -> list[RecordedMember]:
    """Prepare a lifetime. Return a member for each species, or a single member without species.

    `agents`: all agents of the generation.
    """
    seed, run, generation = key
    if agents.species is None:
        genome = trim_genomes(agents.genome[agents_of_world(settings, world)], settings)
        # `[run]` and `[None]`: the batch has a single run.
        batch = CpuBatch(settings, seed, [run], world=world)
        batch.begin(generation, genome[None])
        return [RecordedMember(settings, batch, slice(0, settings.agents_per_world))]
    sizes = count_agents(agents.species, len(settings.population.species))
    ends = sizes.cumsum()
    species_batch = make_species_batch(
        settings, seed, run, generation, agents.genome, agents.species
    )
    return [
        RecordedMember(member, view, slice(first, end))
        for member, view, first, end in zip(
            species_batch.members,
            species_batch.views(),
            (ends - sizes).tolist(),
            ends.tolist(),
            strict=True,
        )
    ]


def _collect_weights(genome: Genome, members: Sequence[RecordedMember]) -> Genome:
    """Return the genomes with the current weights of module 0. Other modules do not change."""
    changed = genome.copy()
    for member in members:
        # The batch has one run.
        (action_weights,) = member.view.weights()
        changed[member.agents, 0, : member.experiment.weight_count] = action_weights
    return changed


def _record_steps(settings: Experiment, members: Sequence[RecordedMember]) -> Arrays:
    """Simulate a lifetime and return the recorded arrays, [step, agent, ...] or [step, item]."""
    # All species have the same items.
    items = Series("items", range(settings.lifetime.steps), slice(None))
    recorded = record_members(
        members, items, [_make_recorders(settings, member) for member in members]
    )
    arrays_of_members = [
        _convert_units(member, arrays) for member, arrays in zip(members, recorded, strict=True)
    ]
    arrays = _join_members(members, arrays_of_members)
    if "alive" in arrays:
        is_dead = arrays["alive"] == 0
        arrays["x"][is_dead] = np.nan
        arrays["y"][is_dead] = np.nan
    return arrays | {"item_x": items.values[..., 0], "item_y": items.values[..., 1]}


def record_members(
    members: Sequence[RecordedMember],
    items: Recorder,
    series_of_members: Sequence[Mapping[str, Series]],
) -> list[Arrays]:
    """Simulate a lifetime. Return the recorded arrays of each member [time, agent, ...], by name.

    `items` reads the items, which all members share.
    """
    recorders = [
        SpeciesRecorder(member.view, recorder)
        for member, series in zip(members, series_of_members, strict=True)
        for recorder in series.values()
    ]
    record_batch(members[0].view, [items, *recorders])
    return [
        {name: recorder.values for name, recorder in series.items()} for series in series_of_members
    ]


def _make_recorders(settings: Experiment, member: RecordedMember) -> dict[str, Series]:
    """Return the recorders of the agents of a member, by variable of the trace."""
    agents = slice(member.agents.stop - member.agents.start)
    steps = settings.lifetime.steps
    # Positions are read before a step. Inputs, outputs and results are read after the step.
    times_before = range(steps)
    times_after = range(1, steps + 1)
    sensor_type = variables.trace_variables(settings)["sensor"].dtype
    recorders = {
        "x": Series("x", times_before, agents),
        "y": Series("y", times_before, agents),
        "heading": Series("heading", times_before, agents),
        "sensor": Series("inputs", times_after, agents, sensor_type),
        "output": Series("outputs", times_after, agents),
        "action": Series("action", times_after, agents, np.int8),
        "eaten": Series("eaten_kinds", times_after, agents),
    }
    if settings.has_deaths:
        recorders["alive"] = Series("alive", times_before, agents, np.int8)
    return recorders


def _convert_units(member: RecordedMember, arrays: Arrays) -> Arrays:
    """Return the arrays with headings in degrees, eaten items per step, and eaten prey per step."""
    # [step, agent, kind]: differences of the totals since birth are the numbers in each step.
    eaten = np.diff(arrays["eaten"], axis=0, prepend=0)
    prey = [entry.species for entry in member.experiment.eats.prey]
    # The last kinds are the prey species.
    n_item_kinds = eaten.shape[2] - len(prey)
    eaten_prey = {
        variables.eaten_variable(name): eaten[:, :, n_item_kinds + index]
        for index, name in enumerate(prey)
    }
    heading = arrays["heading"] * np.float32(DEGREES_PER_TURN / HEADING_COUNT)
    return arrays | {"heading": heading, "eaten": eaten.sum(axis=2)} | eaten_prey


def _join_members(members: Sequence[RecordedMember], arrays: Sequence[Arrays]) -> Arrays:
    """Concatenate the arrays of all members along the axis of agents.

    Inputs and outputs that a species does not have are NaN. Other missing variables are 0.
    """
    if len(members) == 1:
        return arrays[0]
    experiments = [member.experiment for member in members]
    inputs, columns_of_inputs = combine_inputs([member.inputs for member in experiments])
    n_outputs = max(len(member.actions) for member in experiments)
    columns_of_outputs = [range(len(member.actions)) for member in experiments]
    padded = [
        values
        | {
            "sensor": pad_columns(values["sensor"], sensor_columns, len(inputs)),
            "output": pad_columns(values["output"], output_columns, n_outputs),
        }
        for values, sensor_columns, output_columns in zip(
            arrays, columns_of_inputs, columns_of_outputs, strict=True
        )
    ]
    names = dict.fromkeys(name for values in padded for name in values)
    zeros = [np.zeros_like(values["eaten"]) for values in padded]
    return {
        name: np.concatenate(
            [values.get(name, zero) for values, zero in zip(padded, zeros, strict=True)], axis=1
        )
        for name in names
    }


def pad_columns(
    values: npt.NDArray[Any], columns: Sequence[int], n_columns: int, fill: float = np.nan
) -> npt.NDArray[np.float32]:
    """Return an array [step, agent, n_columns] with `values` in `columns`, and `fill` in others."""
    padded = np.full((*values.shape[:2], n_columns), fill, np.float32)
    padded[:, :, columns] = values
    return padded
