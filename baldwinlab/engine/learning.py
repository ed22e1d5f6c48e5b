"""Thinking and learning in life: the action module, and the reinforcement module that teaches it.

Source: the paper, "The Self-taught neural architecture".
"""

from __future__ import annotations

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.lanes import Lane, get, put
from baldwinlab.engine.networks import Rows, backward, forward
from baldwinlab.engine.state import CODES, NO_LEARNING, SELF_TAUGHT, Model, State


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
def think(model: Model, state: State, lane: Lane) -> None:
    """The action module's outputs; those of an agent that does not learn have been looked up when it sensed."""
    if model.rule != NO_LEARNING:
        forward(model.sizes, model.biases, state.weights, state.activations, lane)


@compiled
def learn(model: Model, state: State, lane: Lane) -> None:
    """Change the weights: in self-teaching, the answer to what was sensed moves towards the reinforcement module's."""
    if model.rule == SELF_TAUGHT:
        backward(model.sizes, model.biases, model.rate, state.weights, state.activations, state.errors, state.targets, lane)
