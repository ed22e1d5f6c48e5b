"""Helper of the oracles of several learning rules, in plain Python."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def list_synapses(naive: Any, agent: Any) -> Iterator[tuple[list[float], int, float, float]]:
    """Yield every weight of an agent's action module.

    An entry is the row, the index in the row, and the activations of the source and target units.
    """
    units = naive.units(agent.action_module, agent.inputs)
    for layer, sources, targets in zip(agent.action_module, units, units[1:], strict=False):
        for x, row in zip(sources + [1.0] * naive.biases, layer, strict=True):
            for unit, y in enumerate(targets):
                yield row, unit, x, y
