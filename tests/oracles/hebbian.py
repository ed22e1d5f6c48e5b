"""Oracles in plain Python: Hebbian learning rules."""

from __future__ import annotations

from itertools import repeat
from typing import Any

import numpy as np

from baldwinlab.models.miniworld.learning.hebbian import COVARIANCE, HEBB, POSTSYNAPTIC, PRESYNAPTIC
from baldwinlab.parts.learning_rules import MAX_WEIGHT


def apply_abcd(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    _change_weights(part, agent, naive)


def apply_modulated(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    _change_weights(part, agent, naive, _compute_gate(agent, naive))


def apply_hebb(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    _update_weights(HEBB, agent, naive)


def apply_postsynaptic(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    _update_weights(POSTSYNAPTIC, agent, naive)


def apply_presynaptic(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    _update_weights(PRESYNAPTIC, agent, naive)


def apply_covariance(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    _update_weights(COVARIANCE, agent, naive)


def _change_weights(part: Any, agent: Any, naive: Any, gate: float = 1.0) -> None:
    """Update weights by the coefficients a to d, which are per weight if they are inherited."""
    is_inherited = "a" in agent.arrays
    if is_inherited:
        coefficients: Any = zip(*(agent.arrays[name] for name in "abcd"), strict=True)
    else:
        coefficients = repeat([float(value) for value in (part.a, part.b, part.c, part.d)])
    for (row, unit, x, y), (a, b, c, d) in zip(
        naive.synapses(agent), coefficients, strict=is_inherited
    ):
        changed_weight = row[unit] + agent.rate * gate * (a * x * y + b * x + c * y + d)
        row[unit] = min(max(changed_weight, -float(MAX_WEIGHT)), float(MAX_WEIGHT))


def _compute_gate(agent: Any, naive: Any) -> float:
    return float(2 * naive.think(agent.reinforcement_module, agent.inputs)[0] - 1)


def _update_weights(rule: int, agent: Any, naive: Any) -> None:
    # A weight is a fixed sign (1 or -1) times a strength `w` from 0 to 1.
    signs = iter(agent.arrays["signs"])
    for row, unit, x, y in naive.synapses(agent):
        sign = next(signs)
        w = row[unit] * sign
        f = np.tanh(4 * (1 - abs(x - y)) - 2)
        # The index in the tuple is the number of the rule.
        change = (
            (1 - w) * x * y,
            w * (x - 1) * y + (1 - w) * x * y,
            w * x * (y - 1) + (1 - w) * x * y,
            (1 - w) * f if f > 0 else w * f,
        )[rule]
        row[unit] = sign * min(max(w + agent.rate * float(change), 0.0), 1.0)
