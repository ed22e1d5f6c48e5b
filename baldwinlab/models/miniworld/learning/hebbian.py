"""Hebbian learning rules: weights change with the activations of their units.

In the four rules of Floreano, only the *strength* of a weight learns. It is in [0, 1].
The sign of the weight does not change.
By our interpretation, a genome contains weights, and the strength at birth is the absolute value of
the weight, at most 1. In the paper, a genome encodes signs and rules, and the strengths are random
at birth. `learning.rate` is the factor of a change.
With x and y the activations of the source and target unit, in [0, 1], the changes are:

    hebb            (1 - w) x y
    postsynaptic    w (x - 1) y + (1 - w) x y
    presynaptic     w x (y - 1) + (1 - w) x y
    covariance      (1 - w) F where F > 0, else w F, with F = tanh(4 (1 - |x - y|) - 2)

Sources:

- D. Floreano and F. Mondada, "Evolutionary neurocontrollers for autonomous mobile robots", Neural
  Networks 11 (1998).
- J. Urzelai and D. Floreano, "Evolution of adaptive synapses", Evolutionary Computation 9 (2001).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import ONE, TWO, ZERO, Lane, Value, choose, get, put
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.learning_rules import Synapse, SynapticRule, compute_change

FOUR = np.float32(4)
# Numbers of the rules, for compiled code.
HEBB = 0
POSTSYNAPTIC = 1
PRESYNAPTIC = 2
COVARIANCE = 3


@compiled
def compute_strength_change(rule: int, w: Value, x: Value, y: Value) -> Value:
    """Return the change of a strength w between units with activations x and y."""
    if rule == POSTSYNAPTIC:
        return w * (x - ONE) * y + (ONE - w) * x * y
    if rule == PRESYNAPTIC:
        return w * x * (y - ONE) + (ONE - w) * x * y
    if rule == COVARIANCE:
        # f is the hyperbolic tangent of the formula.
        f = TWO * sigmoid(TWO * (FOUR * (ONE - abs(x - y)) - TWO)) - ONE
        return choose(f > ZERO, (ONE - w) * f, w * f)
    # HEBB. `ZERO * w` gives the result the type of w.
    return (ONE - w) * x * y + ZERO * w


class _StrengthRule(SynapticRule):
    """Base of the rules of strengths. `compute_change` returns the change of a strength."""

    # 1 or -1: signs of the weights at birth.
    arrays: ClassVar[Mapping[str, Array]] = {"signs": per_agent("weights")}

    def check(self, experiment: Any) -> None:
        rate = experiment.learning.rate
        if rate > 1 or experiment.learning.evolved_rate:
            is_too_large = rate > 1
            problem = (
                f"is {rate:g} and must be at most 1"
                if is_too_large
                else "cannot be a gene (learning.evolved_rate)"
            )
            raise ValueError(
                f"learning.rule = {self.name!r} keeps strengths in [0, 1]: learning.rate {problem}"
            )

    @staticmethod
    def init_agent(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        """Store the signs of the weights, and limit the strengths to 1."""
        lane = world * model.agents + agent
        for weight in range(state.weights.shape[0]):
            weight_at_birth = state.weights[weight, lane]
            part.signs[weight, lane] = -ONE if weight_at_birth < ZERO else ONE
            state.weights[weight, lane] = min(max(weight_at_birth, -ONE), ONE)

    @staticmethod
    def change_synapse(part: Any, state: State, synapse: Synapse, lane: Lane) -> None:
        """Change the strength of a weight, and limit it to [0, 1]."""
        sign = get(part.signs, synapse.number, lane)
        strength = synapse.weight * sign
        strength_synapse = Synapse(synapse.number, strength, synapse.x, synapse.y, synapse.rate)
        change = compute_change(part, state, strength_synapse, lane)
        strength = strength + synapse.rate * change
        # Rounding can exceed the limits.
        strength = choose(strength < ZERO, ZERO, choose(strength > ONE, ONE, strength))
        put(state.weights, synapse.number, lane, sign * strength)


def _change_by(rule: int) -> Any:
    """Return the hook `compute_change` of a rule."""

    def compute_change(part: Any, state: State, synapse: Synapse, lane: Lane) -> Value:
        return compute_strength_change(rule, synapse.weight, synapse.x, synapse.y)

    return staticmethod(compute_change)


class Hebb(_StrengthRule, name="hebb"):
    """Hebbian rule: a strength grows if both units are active.

    The strength of a weight is in [0, 1], and its sign does not change.

    References
    ----------
    Floreano and Mondada 1998.
    """

    compute_change: ClassVar[Any] = _change_by(HEBB)


class Postsynaptic(_StrengthRule, name="postsynaptic"):
    """Hebbian rule: a strength also shrinks if only the target unit is active.

    References
    ----------
    Floreano and Mondada 1998.
    """

    compute_change: ClassVar[Any] = _change_by(POSTSYNAPTIC)


class Presynaptic(_StrengthRule, name="presynaptic"):
    """Hebbian rule: a strength also shrinks if only the source unit is active.

    References
    ----------
    Floreano and Mondada 1998.
    """

    compute_change: ClassVar[Any] = _change_by(PRESYNAPTIC)


class Covariance(_StrengthRule, name="covariance"):
    """Hebbian rule: a strength grows if both units are similar, and shrinks if they differ.

    References
    ----------
    Floreano and Mondada 1998.
    """

    compute_change: ClassVar[Any] = _change_by(COVARIANCE)
