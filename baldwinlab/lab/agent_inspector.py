"""Inside an agent: what its two networks do in every step of a life, how its weights move, and who its kin are."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.evolution import Parents, elders_of, next_genome
from baldwinlab.experiment import Experiment
from baldwinlab.lab import Lab, binary_frames
from baldwinlab.lab.life_query import MOST_BYTES, Life, Past, Span, answer, require_agent
from baldwinlab.lab.query import number
from baldwinlab.models.miniworld.appearance import look
from baldwinlab.models.miniworld.backends.cpu import Batch
from baldwinlab.models.miniworld.lookup import AskTeacher, Reflex, Teacher, kind_of_recall
from baldwinlab.parts.agent_parts import forward, links
from baldwinlab.simulation.recorder import Series, follow
from baldwinlab.simulation.reevaluation import born, lived

MOST_INPUTS = 4  # of which every combination is a line of a table
SAMPLES = 201  # of the weights over a life, birth and death among them

Floats = npt.NDArray[np.float32]


def routes(lab: Lab) -> list[BaseRoute]:
    async def inside(request: Request) -> Response:
        agent = number(request.query_params, "agent")
        return await answer(
            lab, request, _bytes_of_step, lambda life, part: look_inside(life, part, agent)
        )

    return [Route("/api/inside", inside)]


def _bytes_of_step(experiment: Experiment) -> int:
    return 13 + 2 * 4 * sum(experiment.layer_sizes)


def look_inside(life: Life, part: Span, agent: int) -> bytes:
    """The container about one agent: its whole life in weights, and its activations in a part of it.

    Arrays: sample_step [sample], weights [sample, weight] of the action module at the beginning of that step (the last: at
    death); activations [step, unit] of the action module, inputs first; action [step], what was done, which noise may have
    made another than the largest output; responses [sample, code], where inputs are few, none is real-valued and there is no
    memory: the action of the largest output for each combination of inputs, of which bit k of the code says whether input k is
    1; eaten_in_life [step], items, with this step; and with a reinforcement module: teacher [weight], teacher_activations
    [step, unit], and, where it says how to act, error [step], the root mean square of the difference between the modules'
    outputs; of a network that is no layers, links [link, (from unit, to unit, weight)]. Raises MissingError as `require_agent`
    does.
    """
    experiment = life.experiment
    require_agent(life.experiment, agent)
    past, (seed, run, generation) = life.past(), life.moment
    batch = born(experiment, seed, [run], generation, past.genome[None])
    arrays = _follow(experiment, batch, part, agent)
    few = len(experiment.inputs) <= MOST_INPUTS and not experiment.real_valued
    if few and experiment.part("network.kind").is_memoryless:
        arrays["responses"] = _responses(experiment, batch, arrays["weights"])
    _ask_modules(experiment, batch, past.genome[agent, :, : experiment.weight_count], arrays)
    if (linked := _links(batch, arrays["weights"][0])).size:
        arrays["links"] = linked
    energy = lived(experiment, batch, past.genome[None]).energy[0]
    header = {
        "kind": "inside",
        "agent": agent,
        **part._asdict(),
        "look": look(experiment).to_dict(),
        "layer_sizes": experiment.layer_sizes,
        "biases": experiment.network.biases,
        **_kin(life, past, energy, agent),
        "food": int(batch.eaten_in_life()[0, agent].sum()),
        "rank": 1 + int((energy > energy[agent]).sum()),
    }
    return binary_frames.pack(header, arrays)


def _follow(
    experiment: Experiment, batch: Batch, part: Span, agent: int
) -> dict[str, npt.NDArray[Any]]:
    """Live the whole life. What is written down of a step is there after it; weights are as they were before it."""
    steps = experiment.lifetime.steps
    wanted = min(SAMPLES, max(2, MOST_BYTES // (4 * experiment.weight_count)))
    samples, done = (
        np.unique(np.linspace(0, steps, wanted).astype(np.uint32)),
        range(part.first + 1, part.last + 1),
    )
    notes = {
        "weights": Series("weights", samples.tolist(), agent),
        "activations": Series("activations", done, agent),
        "action": Series("action", done, agent, np.uint16),
        "eaten_in_life": Series("eaten_in_life", done, agent, np.uint32),
    }
    if kind_of_recall(experiment) is AskTeacher:
        notes["teacher_activations"] = Series("teacher_activations", done, agent)
    follow(batch, list(notes.values()))
    arrays = {"sample_step": samples, **{name: note.values for name, note in notes.items()}}
    arrays["eaten_in_life"] = binary_frames.narrowed(arrays["eaten_in_life"])
    return arrays


def _ask_modules(
    experiment: Experiment, batch: Batch, genome: Floats, arrays: dict[str, npt.NDArray[Any]]
) -> None:
    """Add what the modules of `genome` [module, weight] that learning does not change answer to what was sensed.

    Where the engine looks answers up, it leaves hidden units out: there, and only there, the modules are asked again.
    """
    inputs, recall = arrays["activations"][:, : len(experiment.inputs)], kind_of_recall(experiment)
    if recall is Reflex:
        arrays["activations"] = _answers(batch, genome[0], inputs)
    if recall is Teacher:
        arrays["teacher_activations"] = _answers(batch, genome[1], inputs)
    if "reinforcement" not in experiment.modules:
        return
    arrays["teacher"] = genome[1]
    if not experiment.part("learning.rule").answers:  # the two can be compared
        outputs = slice(-len(experiment.actions), None)
        difference = arrays["activations"][:, outputs] - arrays["teacher_activations"][:, outputs]
        arrays["error"] = np.sqrt((difference**2).mean(axis=1))


def _responses(experiment: Experiment, batch: Batch, weights: Floats) -> npt.NDArray[np.uint8]:
    """[sample, code]: what the action module would have the agent do."""
    count, actions = len(experiment.inputs), len(experiment.actions)
    codes = (np.arange(2**count)[:, None] >> np.arange(count) & 1).astype(np.float32)
    different, which = np.unique(
        weights, axis=0, return_inverse=True
    )  # who does not learn has but one
    outputs = np.stack([_answers(batch, sample, codes)[:, -actions:] for sample in different])
    return np.asarray(outputs.argmax(axis=2)[which.ravel()], np.uint8)


def _answers(batch: Batch, weights: Floats, inputs: Floats) -> Floats:
    """The activations [step, unit] of a module without memory for what was sensed, `inputs` [step, input]."""
    different, which = np.unique(inputs, axis=0, return_inverse=True)
    activations = np.zeros((len(batch.state.activations), len(different)), np.float32)
    activations[: inputs.shape[1]] = different.T
    of_lane = np.repeat(weights[:, None], len(different), axis=1)
    for lane in range(len(different)):
        forward(batch.state.network, of_lane, activations, lane)
    return np.ascontiguousarray(activations.T[which.ravel()])


def _links(batch: Batch, weights: Floats) -> Floats:
    """[link, (from unit, to unit, weight)], of a network that is no layers."""
    found = np.empty((len(weights), 3), np.float32)
    return found[
        : links(batch.state.network, weights[:, None], len(batch.state.activations), 0, found)
    ]


def _kin(life: Life, past: Past, energy: npt.NDArray[np.float64], agent: int) -> dict[str, Any]:
    """An agent's parents, the fitter one first, whose learned weights teach it, and its children.

    Who breeds follows from `energy` [agent] alone, unless others are born in mid-life: nobody is named then.
    """
    experiment, moment = life.experiment, life.moment
    parents, elders, children = None, None, list[int]()
    if experiment.births_in_life:
        return {"parents": parents, "elders": elders, "children": children}
    if moment.generation > 0:
        assert past.energy is not None
        before = past.energy.values[moment.generation - 1]
        pairs = next_genome(experiment, moment, past.genome, before)[1]
        parents, elders = (
            _agents(pairs, agent),
            _agents(elders_of(experiment, moment, pairs), agent),
        )
    if moment.generation + 1 < experiment.evolution.generations:
        after = moment._replace(generation=moment.generation + 1)
        pairs = next_genome(experiment, after, past.genome, energy)[1]
        children = np.flatnonzero((pairs == agent).any(axis=1)).tolist()
    return {"parents": parents, "elders": elders, "children": children}


def _agents(pairs: Parents | None, agent: int) -> list[int] | None:
    """The two of an agent; None where there are none."""
    return None if pairs is None or pairs[agent].min() < 0 else pairs[agent].tolist()
