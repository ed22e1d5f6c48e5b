"""Inside an agent: what its two networks do in every step of a life, how its weights move, and who its kin are."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.evolution import next_genome
from baldwinlab.experiment import Experiment
from baldwinlab.lab import Lab, MissingError, frames
from baldwinlab.lab.lives import MOST_BYTES, Life, Past, Span, answer
from baldwinlab.lab.query import number
from baldwinlab.models.miniworld.cpu import Block
from baldwinlab.models.miniworld.networks import forward
from baldwinlab.models.miniworld.state import CODES
from baldwinlab.runs.relive import born, lived

SAMPLES = 201  # of the weights over a life, birth and death among them

Floats = npt.NDArray[np.float32]


def routes(lab: Lab) -> list[BaseRoute]:
    async def inside(request: Request) -> Response:
        agent = number(request.query_params, "agent")
        return await answer(lab, request, _bytes_of_step, lambda life, part: look_inside(life, part, agent))

    return [Route("/api/inside", inside)]


def _bytes_of_step(experiment: Experiment) -> int:
    return 12 + 2 * 4 * sum(experiment.layer_sizes)


def look_inside(life: Life, part: Span, agent: int) -> bytes:
    """The container about one agent: its whole life in weights, and its activations in a part of it.

    Arrays: sample_step [sample], weights [sample, weight] of the action module at the beginning of that step (the last: at
    death); activations [step, unit] of the action module, sensors first; eaten [step], items so far in life with this step;
    and with a reinforcement module: teacher [weight], teacher_activations [step, unit], and error [step], the root mean square
    of the difference between the modules' outputs. Raises MissingError for an agent that the population has not.
    """
    experiment = life.experiment
    if agent >= experiment.population.size:
        raise MissingError(f"{experiment.name} has no agent {agent}: its agents are 0 to {experiment.population.size - 1}")
    past, (seed, run, generation) = life.past(), life.moment
    block = born(experiment, seed, [run], generation, past.genome[None])
    arrays = _follow(experiment, block, part, agent)
    _ask_modules(experiment, past.genome[agent, :, : experiment.weight_count], arrays)
    energy = lived(experiment, block, past.genome[None]).energy[0]
    header = {
        "kind": "inside",
        "agent": agent,
        **part._asdict(),
        "layer_sizes": experiment.layer_sizes,
        "biases": experiment.network.biases,
        **_kin(life, past, energy, agent),
        "food": int(block.eaten()[0, agent].sum()),
        "rank": 1 + int((energy > energy[agent]).sum()),
    }
    del arrays["code"]
    return frames.pack(header, arrays)


def _follow(experiment: Experiment, block: Block, part: Span, agent: int) -> dict[str, npt.NDArray[Any]]:
    """Live the whole life. What is written down of a step is there after it; weights are as they were before it."""
    steps, state = experiment.lifetime.steps, block.state
    wanted = min(SAMPLES, max(2, MOST_BYTES // (4 * experiment.weight_count)))
    samples = np.unique(np.linspace(0, steps, wanted).astype(np.uint32))
    length = part.last - part.first
    arrays: dict[str, npt.NDArray[Any]] = {
        "sample_step": samples,
        "weights": np.empty((samples.size, experiment.weight_count), np.float32),
        "activations": np.empty((length, sum(experiment.layer_sizes)), np.float32),
        "code": np.empty(length, np.uint8),
        "eaten": np.empty(length, np.uint32),
    }
    place = {int(step): sample for sample, step in enumerate(samples)}
    for begin, end in pairwise(sorted({*place, *range(part.first, part.last + 1)})):
        if begin in place:
            arrays["weights"][place[begin]] = state.weights[:, agent]
        block.live(begin, end)
        if part.first <= begin < part.last:
            row = begin - part.first
            arrays["activations"][row] = state.activations[:, agent]
            arrays["code"][row] = state.code[agent]
            arrays["eaten"][row] = state.eaten[:, agent].sum()
    arrays["weights"][-1] = state.weights[:, agent]
    arrays["eaten"] = frames.narrowed(arrays["eaten"])
    return arrays


def _ask_modules(experiment: Experiment, genome: Floats, arrays: dict[str, npt.NDArray[Any]]) -> None:
    """Add what the modules of `genome` [module, weight] that learning does not change answer to what was sensed.

    Where nothing is learned, the engine itself looks up what the action module answers, and leaves its hidden units out.
    """
    code = arrays["code"]
    if not experiment.learns:
        arrays["activations"] = _answers(experiment, genome[0])[code]
    if len(genome) > 1:
        arrays["teacher"] = genome[1]
        arrays["teacher_activations"] = _answers(experiment, genome[1])[code]
        difference = arrays["activations"][:, -3:] - arrays["teacher_activations"][:, -3:]
        arrays["error"] = np.sqrt((difference**2).mean(axis=1))


def _answers(experiment: Experiment, weights: Floats) -> Floats:
    """The activations [code, unit] of a module for everything that can be sensed."""
    activations = np.zeros((sum(experiment.layer_sizes), CODES), np.float32)
    of_code = np.repeat(weights[:, None], CODES, axis=1)
    for code in range(CODES):
        activations[:3, code] = [(code >> side) & 1 for side in range(3)]
        forward(np.array(experiment.layer_sizes, np.int64), experiment.network.biases, of_code, activations, code)
    return activations.T


def _kin(life: Life, past: Past, energy: npt.NDArray[np.float64], agent: int) -> dict[str, Any]:
    """An agent's parents, the fitter one first, and its children. Who breeds follows from `energy` [agent] alone."""
    experiment, moment = life.experiment, life.moment
    parents, children = None, list[int]()
    if moment.generation > 0:
        assert past.energy is not None
        before = past.energy.values[moment.generation - 1]
        pair = next_genome(experiment, moment, past.genome, before)[1][agent]
        parents = pair.tolist() if pair.min() >= 0 else None
    if moment.generation + 1 < experiment.evolution.generations:
        after = moment._replace(generation=moment.generation + 1)
        pairs = next_genome(experiment, after, past.genome, energy)[1]
        children = np.flatnonzero((pairs == agent).any(axis=1)).tolist()
    return {"parents": parents, "children": children}
