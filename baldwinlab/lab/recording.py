"""A lifetime as the page plays it: lived again from its seed, and written down step by step."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.lab import Lab, frames
from baldwinlab.lab.lives import Life, Span, answer
from baldwinlab.runs.relive import born

TYPES: dict[str, type[np.generic]] = {  # of what is written down in every step, of every agent
    "x": np.float32,
    "y": np.float32,
    "heading": np.uint8,
    "sensor": np.uint8,
    "action": np.uint8,
    "eaten": np.uint32,
}
BYTES_OF_AGENT = sum(np.dtype(dtype).itemsize for dtype in TYPES.values())  # a step


def routes(lab: Lab) -> list[BaseRoute]:
    async def recording(request: Request) -> Response:
        def make(life: Life, part: Span) -> bytes:
            return record(life, part, dict(request.query_params))

        return await answer(lab, request, lambda experiment: BYTES_OF_AGENT * experiment.population.size, make)

    return [Route("/api/recording", recording)]


def record(life: Life, part: Span, source: dict[str, str]) -> bytes:
    """The container of a part of a life; `source` is the query that asked for it, and goes into the header.

    Arrays: x, y float32 [step, agent]; heading [step, agent], in turns of 9 degrees clockwise from +x; sensor [step, agent],
    as bits: 1 left, 2 front, 4 right; action [step, agent], 0 left, 1 forward, 2 right; eaten [step, agent], items so far in
    life with this step; item_x, item_y [item], as they lie at the first step; move_step, move_item, move_x, move_y [move]:
    from that step on the item lies there. Positions are in units of length, and as they stood when the agents sensed.
    """
    experiment, steps = life.experiment, life.experiment.lifetime.steps
    arrays = _arrays(life, part)
    header = {
        "kind": "recording",
        "source": source,
        "condition": experiment.name,
        **life.moment._asdict(),
        **part._asdict(),
        "steps": steps,
        "agents": experiment.population.size,
        "items": arrays["item_x"].size,
        "world": experiment.world.model_dump(mode="json"),
        "visual_radius": experiment.senses.visual_radius,
        "reach": experiment.contact.reach,
        "contact": experiment.contact.shape,
        "learns": experiment.learns,
        "layer_sizes": experiment.layer_sizes,
        "biases": experiment.network.biases,
    }
    return frames.pack(header, arrays)


def _arrays(life: Life, part: Span) -> dict[str, npt.NDArray[Any]]:
    experiment, (seed, run, generation) = life.experiment, life.moment
    block = born(experiment, seed, [run], generation, life.past().genome[None])
    block.live(0, part.first)
    state, agents = block.state, experiment.population.size
    arrays = {name: np.empty((part.last - part.first, agents), dtype) for name, dtype in TYPES.items()}
    items, moves = block.items()[0], _Moves()
    for row, step in enumerate(range(part.first, part.last)):
        if row:
            moves.add(step, np.flatnonzero(state.touched[0] == step - 1), state.item_x[0], state.item_y[0])
        arrays["x"][row], arrays["y"][row] = state.places[:, :agents]
        arrays["heading"][row] = state.heading[0, :agents]
        block.live(step, step + 1)
        arrays["sensor"][row] = state.code[:agents]
        arrays["action"][row] = state.action[0, :agents]
        arrays["eaten"][row] = state.eaten[:, :agents].sum(axis=0)
    arrays["eaten"] = frames.narrowed(arrays["eaten"])
    return arrays | {"item_x": items[:, 0], "item_y": items[:, 1]} | moves.arrays()


class _Moves:
    """Items that have been eaten, and where they have reappeared."""

    def __init__(self) -> None:
        self._found: dict[str, list[npt.NDArray[Any]]] = {"step": [], "item": [], "x": [], "y": []}

    def add(self, step: int, items: npt.NDArray[np.intp], x: npt.NDArray[np.float32], y: npt.NDArray[np.float32]) -> None:
        if items.size:
            places = {"step": np.full(items.size, step), "item": items, "x": x[items], "y": y[items]}
            for name, values in places.items():
                self._found[name].append(values)

    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        types = {"step": np.uint32, "item": np.uint32, "x": np.float32, "y": np.float32}
        return {
            f"move_{name}": np.concatenate([np.empty(0, dtype), *self._found[name]], dtype=dtype, casting="unsafe")
            for name, dtype in types.items()
        }
