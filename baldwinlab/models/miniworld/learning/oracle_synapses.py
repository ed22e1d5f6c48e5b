"""Weights of an agent in plain Python, for the oracles of learning rules."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def list_synapses(naive: Any, agent: Any) -> Iterator[tuple[list[float], int, float, float]]:
    """Yield every weight of an agent's action module.

    An entry is (row of weights, index in the row, activation of the source unit, activation of the
    target unit).
    """
    units = naive.units(agent.action_module, agent.inputs)
    for layer, sources, targets in zip(agent.action_module, units, units[1:], strict=False):
        for x, row in zip(sources + [1.0] * naive.biases, layer, strict=True):
            for unit, y in enumerate(targets):
                yield row, unit, x, y
