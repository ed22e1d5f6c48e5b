"""A lifetime as the page plays it: lived again from its seed, and written down step by step."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.experiment import Experiment
from baldwinlab.lab import Lab, binary_frames
from baldwinlab.lab.experiment_form import shown
from baldwinlab.lab.life_query import Life, Span, answer
from baldwinlab.models.miniworld.appearance import look
from baldwinlab.simulation.recorder import Moves, Series, follow
from baldwinlab.simulation.reevaluation import born

BYTES_OF_AGENT = (
    16  # in every step, but for its inputs: x and y, heading, action, items eaten, teacher
)


def routes(lab: Lab) -> list[BaseRoute]:
    async def recording(request: Request) -> Response:
        def make(life: Life, part: Span) -> bytes:
            return record(life, part, dict(request.query_params))

        return await answer(lab, request, bytes_of_step, make)

    return [Route("/api/recording", recording)]


def bytes_of_step(experiment: Experiment) -> int:
    return experiment.population.size * (BYTES_OF_AGENT + _bytes_of_inputs(experiment))


def record(life: Life, part: Span, source: dict[str, str]) -> bytes:
    """The container of a part of a life; `source` is the query that asked for it, and goes into the header.

    Arrays: x, y float32 [step, agent]; heading [step, agent], in turns clockwise from +x, of which header.look.headings make a
    circle; sensor [step, agent * byte], as bits, eight inputs a byte and the first the lowest: 1 where an input is above 0; or,
    where any input is real-valued, float32 [step, agent * input]; action [step, agent], its number in header.look.actions;
    eaten_in_life [step, agent], with this step; teacher [step, agent], where the learning rule says so: the agent from whom each
    learns in that step, itself for nobody; item_x, item_y [item], as they lie at the first step; move_step, move_item,
    move_x, move_y [move]: from that step on the item lies there. Positions are in units of length, and as they stood when the
    agents sensed.
    """
    experiment = life.experiment
    arrays = _arrays(life, part)
    header = {
        "kind": "recording",
        "source": source,
        "condition": experiment.name,
        **life.moment._asdict(),
        **part._asdict(),
        "steps": experiment.lifetime.steps,
        "agents": experiment.population.size,
        "items": arrays["item_x"].size,
        **shown(experiment),
        "learns": experiment.learns,
        "layer_sizes": experiment.layer_sizes,
        "biases": experiment.network.biases,
    }
    return binary_frames.pack(header, arrays)


def _arrays(life: Life, part: Span) -> dict[str, npt.NDArray[Any]]:
    experiment, (seed, run, generation) = life.experiment, life.moment
    batch = born(experiment, seed, [run], generation, life.past().genome[None])
    agents, found, done = (
        slice(experiment.population.size),
        range(*part),
        range(part.first + 1, part.last + 1),
    )
    moves = Moves(found)
    notes = {
        "x": Series("x", found, agents),
        "y": Series("y", found, agents),
        "heading": Series("heading", found, agents, _small(look(experiment).headings)),
        "sensor": Series(
            "inputs", done, agents, change=np.ravel if experiment.real_valued else _as_bits
        ),
        "action": Series("action", done, agents, _small(len(look(experiment).actions))),
        "eaten_in_life": Series("eaten_in_life", done, agents, np.uint32),
    }
    if experiment.part("learning.rule").teacher_array:
        notes["teacher"] = Series("teacher", done, agents, _small(experiment.population.size))
    follow(batch, [moves, *notes.values()])
    arrays = {name: note.values for name, note in notes.items()} | {
        "item_x": moves.items[:, 0],
        "item_y": moves.items[:, 1],
    }
    arrays["eaten_in_life"] = binary_frames.narrowed(arrays["eaten_in_life"])
    return arrays | {f"move_{name}": column for name, column in moves.columns().items()}


def _small(count: int) -> type[np.generic]:
    """What holds so many different numbers."""
    return np.uint8 if count <= 2**8 else np.uint16


def _bytes_of_inputs(experiment: Experiment) -> int:
    """Of an agent in a step."""
    count = len(experiment.inputs)
    return 4 * count if experiment.real_valued else -(-count // 8)


def _as_bits(inputs: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """[agent, input] as [agent * byte]: 1 where an input is above 0."""
    return np.packbits(inputs > 0, axis=1, bitorder="little").ravel()
