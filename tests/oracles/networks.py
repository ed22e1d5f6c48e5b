"""Oracles in plain Python: networks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any


def compute_feed_forward(part: Any, agent: Any, naive: Any) -> Any:
    return naive.think(agent.action_module, agent.inputs)


def compute_simple_recurrent(part: Any, agent: Any, naive: Any) -> Any:
    return naive.think(agent.action_module, [*agent.inputs, *agent.hidden])


def compute_continuous_time(part: Any, agent: Any, naive: Any) -> Any:
    """Return the outputs. Store the states of the hidden units in `agent.arrays`."""
    hidden, outputs = agent.action_module
    states = agent.arrays.get("states", [0.0] * part.hidden)
    biases = hidden[-1] if part.biases else [0.0] * part.hidden
    # With biases, the last row of `hidden` has no source.
    sources = [*agent.inputs, *_compute_logistic_outputs(states, biases)]
    drives = [
        sum(x * row[unit] for x, row in zip(sources, hidden, strict=False))
        for unit in range(part.hidden)
    ]
    states = [
        state + (drive - state) / part.time_constant
        for state, drive in zip(states, drives, strict=True)
    ]
    agent.arrays["states"] = states
    activations = _compute_logistic_outputs(states, biases) + [1.0] * part.biases
    totals = [
        sum(x * row[unit] for x, row in zip(activations, outputs, strict=True))
        for unit in range(part.actions)
    ]
    return _compute_logistic_outputs(totals, [0.0] * part.actions)


def _compute_logistic_outputs(states: Sequence[float], biases: Sequence[float]) -> list[float]:
    return [1 / (1 + math.exp(-state - bias)) for state, bias in zip(states, biases, strict=True)]
