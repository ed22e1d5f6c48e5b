"""Recordings of lifetimes: simulate a stored lifetime again and record it step by step."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.experiment import Experiment
from baldwinlab.experiment.species import combine_inputs
from baldwinlab.lab import Lab, Query
from baldwinlab.lab.sources import binary_frames
from baldwinlab.lab.sources.experiment_form import describe_world
from baldwinlab.lab.sources.life_query import Life, Span, load_container
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.simulation.recorder import RECORDED_WORLD, ItemMoves, Series
from baldwinlab.simulation.trace import (
    Agents,
    RecordedMember,
    begin_lifetime,
    pad_columns,
    record_members,
)

# Size of x and y, heading, action, eaten items and teacher of one agent in one step.
BYTES_PER_AGENT_STEP = 16
_BITS_PER_BYTE = 8
_FLOAT32_BYTES = 4


def load_recording(lab: Lab, query: Query) -> bytes:
    """Return the container with the requested steps of a lifetime."""
    return load_container(
        lab,
        "recording",
        query,
        estimate_bytes_per_step,
        lambda life, span: record_life(life, span, dict(query)),
    )


def estimate_bytes_per_step(experiment: Experiment) -> int:
    """Return an upper estimate of the size of one recorded step."""
    bytes_per_agent = BYTES_PER_AGENT_STEP + _count_input_bytes(experiment)
    return experiment.agents_per_world * bytes_per_agent


def record_life(life: Life, span: Span, source: dict[str, str]) -> bytes:
    """Return the container with some steps of a lifetime.

    With several worlds, the container has the agents of world 0. With several lifetimes, it has the
    first one.

    The container (`binary_frames.pack`) has these arrays. Positions are in map units, at the
    time of sensing.

    - x, y: float32 [step, agent].
    - heading: [step, agent], clockwise from +x, in units of 1 / header.appearance.headings of a
      circle.
    - sensor: [step, agent * byte], the inputs as bits, eight inputs per byte, lowest bit first. A
      bit is 1 if the input is above 0. If an input is real-valued: float32 [step, agent * input].
    - action: [step, agent], an index into header.appearance.actions.
    - eaten_in_life: [step, agent], number of items eaten up to and including the step.
    - teacher: [step, agent], only for rules that learn from others. The index of the teacher,
      or the agent's own index if there is no teacher.
    - species: [agent], only with several species. The index of the species in header.species.
      With species, x and y of a dead agent are NaN.
    - item_x, item_y: [item], at the first step.
    - move_step, move_item, move_x, move_y: [move]. From the step move_step, the item move_item has
      the position (move_x, move_y).
    """
    experiment = life.experiment.at(life.key.generation)
    arrays = _record_arrays(life, span)
    header = {
        "kind": "recording",
        "source": source,
        "condition": experiment.name,
        **life.key._asdict(),
        **span.make_header(),
        "steps": experiment.lifetime.steps,
        # Only agents and items of world 0, because each world has its own items.
        "agents": experiment.agents_per_world,
        "items": arrays["item_x"].size,
        **describe_world(experiment),
        "learns": experiment.learns,
        "layer_sizes": experiment.layer_sizes,
        "biases": experiment.network.biases,
    }
    return binary_frames.pack(header, arrays)


def _record_arrays(life: Life, span: Span) -> dict[str, npt.NDArray[Any]]:
    experiment = life.experiment.at(life.key.generation)
    start = life.load_start_data()
    agents = Agents(start.genomes, start.species)
    members = begin_lifetime(experiment, agents, life.key, RECORDED_WORLD)
    moves = ItemMoves(_times_before_steps(span))
    if start.species is None:
        pack_inputs = np.ravel if experiment.real_valued else _pack_bits
        (arrays,) = record_members(members, moves, [_make_series(experiment, span, pack_inputs)])
    else:
        arrays = _record_species(experiment, members, span, moves)
        arrays["species"] = start.species.astype(np.uint8)
    arrays["item_x"] = moves.items[:, 0]
    arrays["item_y"] = moves.items[:, 1]
    arrays["eaten_in_life"] = binary_frames.narrow(arrays["eaten_in_life"])
    return arrays | {f"move_{name}": column for name, column in moves.columns().items()}


def _times_before_steps(span: Span) -> range:
    """Return the times at which positions are recorded. A time is a number of simulated steps."""
    return range(span.first, span.stop)


def _make_series(
    experiment: Experiment, span: Span, pack_inputs: Callable[[Any], Any]
) -> dict[str, Series]:
    """Return the recorders of the agents of world 0, by the name of the array.

    Positions are recorded before a step. Inputs, actions and eaten items are recorded after it.
    `pack_inputs` gets the inputs [agent, input] of a step.
    """
    before = _times_before_steps(span)
    after = range(span.first + 1, span.stop + 1)
    agents = slice(experiment.agents_per_world)
    appearance = describe_appearance(experiment)
    heading_type = _choose_unsigned_type(appearance.headings)
    action_type = _choose_unsigned_type(len(appearance.actions))
    series = {
        "x": Series("x", before, agents),
        "y": Series("y", before, agents),
        "heading": Series("heading", before, agents, heading_type),
        "sensor": Series("inputs", after, agents, transform=pack_inputs),
        "action": Series("action", after, agents, action_type),
        "eaten_in_life": Series("eaten_in_life", after, agents, np.uint32),
    }
    if experiment.part("learning.rule").teacher_array:
        agent_index_type = _choose_unsigned_type(experiment.agents_per_world)
        series["teacher"] = Series("teacher", after, agents, agent_index_type)
    return series


def _record_species(
    experiment: Experiment, members: Sequence[RecordedMember], span: Span, moves: ItemMoves
) -> dict[str, npt.NDArray[Any]]:
    """Simulate the steps of several species, and return the arrays [step, agent] of all agents."""
    settings_of_species = [member.experiment for member in members]
    # The inputs stay unpacked, because `_join_inputs` adds the inputs that a species lacks.
    series_of_species = [
        _make_series(settings, span, np.asarray) for settings in settings_of_species
    ]
    if experiment.has_deaths:
        for settings, series in zip(settings_of_species, series_of_species, strict=True):
            agents = slice(settings.population.size)
            series["alive"] = Series("alive", _times_before_steps(span), agents, np.uint8)
    arrays_of_species = record_members(members, moves, series_of_species)
    inputs_of_species = [arrays.pop("sensor") for arrays in arrays_of_species]
    # The agents of all species along the axis 1. `teacher` is missing unless all species have it.
    joined = {
        name: np.concatenate([arrays[name] for arrays in arrays_of_species], axis=1)
        for name in set.intersection(*({*arrays} for arrays in arrays_of_species))
    }
    if experiment.has_deaths:
        is_dead = joined.pop("alive") == 0
        for name in ("x", "y"):
            joined[name] = np.where(is_dead, np.float32(np.nan), joined[name])
    return joined | {"sensor": _join_inputs(settings_of_species, inputs_of_species)}


def _join_inputs(
    members: Sequence[Experiment], inputs_of_species: Sequence[npt.NDArray[np.float32]]
) -> npt.NDArray[Any]:
    """Return the array `sensor` of `record_life` from the inputs [step, agent, input] by species.

    `combine_inputs` gives the order of the inputs. An input that a species lacks is 0.
    """
    names, columns_of_species = combine_inputs([member.inputs for member in members])
    padded = [
        pad_columns(inputs, columns, len(names), fill=0)
        for inputs, columns in zip(inputs_of_species, columns_of_species, strict=True)
    ]
    joined: npt.NDArray[Any] = np.concatenate(padded, axis=1)
    if not any(member.real_valued for member in members):
        joined = np.packbits(joined > 0, axis=2, bitorder="little")
    return joined.reshape(len(joined), -1)


def _choose_unsigned_type(n_values: int) -> type[np.generic]:
    """Return the smaller of uint8 and uint16 that can hold the values 0 to `n_values` - 1."""
    return np.uint8 if n_values <= 2**8 else np.uint16


def _count_input_bytes(experiment: Experiment) -> int:
    appearance = describe_appearance(experiment)
    n_inputs = len(appearance.inputs)
    if any(appearance.is_continuous):
        return _FLOAT32_BYTES * n_inputs
    return math.ceil(n_inputs / _BITS_PER_BYTE)


def _pack_bits(inputs: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """Return inputs [agent, input] as bits [agent * byte]: 1 if an input is above 0."""
    return np.packbits(inputs > 0, axis=1, bitorder="little").ravel()
