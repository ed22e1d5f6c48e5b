"""Thinking and learning in life: the action module, and the reinforcement module that teaches it.

Source: the paper, "The Self-taught neural architecture". Drift is a control of ours: docs/controls.md.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import power_of_ten
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.lanes import Lane, get, put
from baldwinlab.engine.rng import DRIFT, philox
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.networks import Rows, backward, forward
from baldwinlab.models.miniworld.state import CODES, DRIFTING, FASTEST_LEARNING, NO_LEARNING, SELF_TAUGHT, Model, State

ONE = np.float32(1)


def rates(experiment: Experiment, genomes: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """The learning rate of every agent, from its gene if it has one. `genomes` is [..., module, weight]."""
    found = np.full(genomes.shape[:-2], experiment.learning.rate, np.float32)
    if experiment.learning.evolved_rate:
        _express(experiment.learning.rate, genomes[..., 0, -1].ravel(), found.reshape(-1))
    return found


@compiled
def _express(rate: float, genes: npt.NDArray[np.float32], found: npt.NDArray[np.float32]) -> None:
    for agent in range(genes.size):
        found[agent] = np.float32(min(rate * power_of_ten(genes[agent]), FASTEST_LEARNING))


@compiled
def prepare(model: Model, state: State, fixed: Rows, lane: Lane) -> None:
    """Ask the module that learning does not change (weights `fixed`) for its answer to everything that can be sensed.

    That is the reinforcement module of an agent that learns; of one that does not, it is the action module.
    """
    outputs = state.activations.shape[0] - 3
    for code in range(CODES):
        for k in range(3):
            put(state.activations, k, lane, np.float32((code >> k) & 1))
        forward(model.sizes, model.biases, fixed, state.activations, lane)
        for k in range(3):
            put(state.answers, code * 3 + k, lane, get(state.activations, outputs + k, lane))


@compiled
def choose_directions(model: Model, state: State, world: int, agent: int) -> None:
    """For drift: whether each weight will move as self-teaching would move it, or against it."""
    lane = world * model.agents + agent
    if model.rule == DRIFTING:
        seed, run = state.keys[world, 0], state.keys[world, 1]
        for weight in range(state.weights.shape[0]):
            words = philox(weight, agent, state.generation[0], DRIFT, seed, run)
            state.signs[weight, lane] = ONE if words[0] & np.uint32(1) else -ONE
            state.newborn[weight, lane] = state.weights[weight, lane]
            state.pupil[weight, lane] = state.weights[weight, lane]


@compiled
def think(model: Model, state: State, lane: Lane) -> None:
    """The action module's outputs; those of an agent that does not learn have been looked up when it sensed."""
    if model.rule != NO_LEARNING:
        forward(model.sizes, model.biases, state.weights, state.activations, lane)


@compiled
def learn(model: Model, state: State, step: int, lane: Lane) -> None:
    """Change the weights: in self-teaching, the answer to what was sensed moves towards the reinforcement module's."""
    if step >= model.learning_steps:
        return
    rate = get(state.rate, 0, lane)
    if model.rule == SELF_TAUGHT:
        backward(model.sizes, model.biases, rate, state.weights, state.activations, state.errors, state.targets, lane)
    if model.rule == DRIFTING:
        drift(model, state, lane)


@compiled
def drift(model: Model, state: State, lane: Lane) -> None:
    """A pupil teaches itself from what the agent senses, and each of the agent's weights stays as far from birth as the pupil's.

    Some move in the same direction, some in the opposite one, so it is as much change, but nothing is learned.
    """
    for k in range(3):
        put(state.pupil_activations, k, lane, get(state.activations, k, lane))
    forward(model.sizes, model.biases, state.pupil, state.pupil_activations, lane)
    rate = get(state.rate, 0, lane)
    backward(model.sizes, model.biases, rate, state.pupil, state.pupil_activations, state.errors, state.targets, lane)
    for weight in range(state.weights.shape[0]):
        moved = get(state.pupil, weight, lane) - get(state.newborn, weight, lane)
        put(state.weights, weight, lane, get(state.newborn, weight, lane) + get(state.signs, weight, lane) * moved)
