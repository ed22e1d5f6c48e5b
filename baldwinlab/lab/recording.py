"""Recordings of lifetimes: simulate a stored lifetime again and record it step by step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.experiment import Experiment
from baldwinlab.lab import Lab, binary_frames
from baldwinlab.lab.experiment_form import describe_world
from baldwinlab.lab.life_query import Life, Span, queue_container
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.simulation.recorder import RECORDED_WORLD, ItemMoves, Series, record_batch
from baldwinlab.simulation.reevaluation import make_batch

# Size of a recorded step, without inputs: x and y, heading, action, items eaten, teacher.
BYTES_PER_AGENT_STEP = 16
_BITS_PER_BYTE = 8
_FLOAT32_BYTES = 4


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    async def recording(request: Request) -> Response:
        def make(life: Life, span: Span) -> bytes:
            return record_life(life, span, dict(request.query_params))

        return await queue_container(lab, request, estimate_bytes_per_step, make)

    return [Route("/api/recording", recording)]


def estimate_bytes_per_step(experiment: Experiment) -> int:
    """Return an upper estimate of the size of one recorded step."""
    bytes_per_agent = BYTES_PER_AGENT_STEP + _count_input_bytes(experiment)
    return experiment.agents_per_world * bytes_per_agent


def record_life(life: Life, span: Span, source: dict[str, str]) -> bytes:
    """Return the container with some steps of a lifetime.

    With several worlds, the container has the agents of world 0. With several lifetimes, it has the
    first one.

    Parameters
    ----------
    life
        The lifetime.
    span
        The recorded steps.
    source
        The query that requested the lifetime. It is part of the header.

    Returns
    -------
    bytes
        A container (`binary_frames.pack`) with these arrays. Positions are in map units, at the
        time of sensing.

        - x, y: float32 [step, agent].
        - heading: [step, agent], clockwise from +x, in units of 1 / header.appearance.headings of a
          circle.
        - sensor: [step, agent * byte] as bits, eight inputs per byte, lowest bit first. A bit is 1
          if the input is above 0. If an input is real-valued: float32 [step, agent * input].
        - action: [step, agent], an index of header.appearance.actions.
        - eaten_in_life: [step, agent], number of items eaten up to and including the step.
        - teacher: [step, agent], only for rules that learn from others. The index of the agent
          that this agent learns from. It is the agent's own index if there is no teacher.
        - item_x, item_y: [item], at the first step.
        - move_step, move_item, move_x, move_y: [move]. The item has this position from that step.

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
        # Agents of world 0. Each world has other items.
        "agents": experiment.agents_per_world,
        "items": arrays["item_x"].size,
        **describe_world(experiment),
        "learns": experiment.learns,
        "layer_sizes": experiment.layer_sizes,
        "biases": experiment.network.biases,
    }
    return binary_frames.pack(header, arrays)


def _record_arrays(life: Life, span: Span) -> dict[str, npt.NDArray[Any]]:
    seed, run, generation = life.key
    experiment = life.experiment.at(generation)
    # The batch has a single run.
    genomes = life.load_start_data().genomes[None]
    batch = make_batch(experiment, seed, [run], generation, genomes, world=RECORDED_WORLD)
    all_agents = slice(experiment.agents_per_world)
    # Positions are recorded before a step, and actions and their results after it. A time is the
    # number of simulated steps.
    times_before_steps = range(span.first, span.stop)
    times_after_steps = range(span.first + 1, span.stop + 1)
    pack_inputs = np.ravel if experiment.real_valued else _pack_bits
    appearance = describe_appearance(experiment)
    heading_type = _choose_unsigned_type(appearance.headings)
    action_type = _choose_unsigned_type(len(appearance.actions))
    moves = ItemMoves(times_before_steps)
    series = {
        "x": Series("x", times_before_steps, all_agents),
        "y": Series("y", times_before_steps, all_agents),
        "heading": Series("heading", times_before_steps, all_agents, heading_type),
        "sensor": Series("inputs", times_after_steps, all_agents, transform=pack_inputs),
        "action": Series("action", times_after_steps, all_agents, action_type),
        "eaten_in_life": Series("eaten_in_life", times_after_steps, all_agents, np.uint32),
    }
    if experiment.part("learning.rule").teacher_array:
        agent_index_type = _choose_unsigned_type(experiment.agents_per_world)
        series["teacher"] = Series("teacher", times_after_steps, all_agents, agent_index_type)
    record_batch(batch, [moves, *series.values()])
    arrays = {name: recorder.values for name, recorder in series.items()}
    arrays["item_x"] = moves.items[:, 0]
    arrays["item_y"] = moves.items[:, 1]
    arrays["eaten_in_life"] = binary_frames.narrow(arrays["eaten_in_life"])
    return arrays | {f"move_{name}": column for name, column in moves.columns().items()}


def _choose_unsigned_type(n_values: int) -> type[np.generic]:
    """Return the smallest unsigned type that can hold a number of different values."""
    return np.uint8 if n_values <= 2**8 else np.uint16


def _count_input_bytes(experiment: Experiment) -> int:
    """Return the size of the inputs of one agent in one step."""
    n_inputs = len(experiment.inputs)
    if experiment.real_valued:
        return _FLOAT32_BYTES * n_inputs
    return math.ceil(n_inputs / _BITS_PER_BYTE)


def _pack_bits(inputs: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """Return inputs [agent, input] as bits [agent * byte]: 1 if an input is above 0."""
    return np.packbits(inputs > 0, axis=1, bitorder="little").ravel()
