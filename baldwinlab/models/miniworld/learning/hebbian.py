"""Hebbian learning rules: a weight changes with the activations of the two connected units.

With x and y the activations of the source and target unit, in [0, 1], the changes are:

    hebb            (1 - w) x y
    postsynaptic    w (x - 1) y + (1 - w) x y
    presynaptic     w x (y - 1) + (1 - w) x y
    covariance      (1 - w) F where F > 0, else w F, with F = tanh(4 (1 - |x - y|) - 2)
    abcd            A x y + B x + C y + D

In the first four rules, by Floreano, w is the *strength* of a weight: the absolute value, in
[0, 1]. The sign of the weight does not change. `learning.rate` is the factor of a change.
By our interpretation, a genome contains weights, and the strength at birth is the absolute value of
the weight, at most 1. In the paper, a genome encodes signs and rules, and the strengths are random
at birth.

The coefficients of `abcd` are fields. The coefficients of `evolved-abcd` are genes: the genome has
one module for each of A, B, C and D in addition to the weights.
`modulated` and `evolved-modulated` multiply the changes by a gate in [-1, 1].
An inherited network, fixed for life, computes the gate in every step. Our interpretation:

- A coefficient is a gene, drawn from N(0, 1) in the first generation, limited to [-1, 1].
- With `encoding = "network"`, the first gene of a module applies to all weights, as in Niv et al.
  With `encoding = "connection"`, each weight has a separate gene, as in Najarro and Risi.
- One gate applies to the complete network: m = tanh(s / 2), with s the total input of the first
  output of the reinforcement module. In the paper, each neuron has its own m, from modulatory
  neurons.
- The rate is `learning.rate`. With `learning.evolved_rate`, a gene changes the rate.

Sources:

- D. Floreano and F. Mondada, "Evolutionary neurocontrollers for autonomous mobile robots", Neural
  Networks 11 (1998).
- J. Urzelai and D. Floreano, "Evolution of adaptive synapses", Evolutionary Computation 9 (2001).
- Y. Niv, D. Joel, I. Meilijson and E. Ruppin, "Evolution of reinforcement learning in uncertain
  environments", Adaptive Behavior 10 (2002).
- A. Soltoggio, J. A. Bullinaria, C. Mattiussi, P. Duerr and D. Floreano, "Evolutionary advantages
  of neuromodulated plasticity in dynamic, reward-based scenarios", ALIFE XI (2008).
- E. Najarro and S. Risi, "Meta-learning through Hebbian plasticity in random networks", NeurIPS 33
  (2020).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final, Literal

import numpy as np
from pydantic import Field

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import ONE, TWO, ZERO, Lane, Value, choose, clamp, get, put
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.learning_rules import Synapse, SynapticRule, compute_change, for_each_synapse

FOUR = np.float32(4)
# Argument `rule` of `compute_strength_change`.
HEBB = 0
POSTSYNAPTIC = 1
PRESYNAPTIC = 2
COVARIANCE = 3


@compiled
def compute_strength_change(rule: int, w: Value, x: Value, y: Value) -> Value:
    """Return the change of a strength w between units with activations x and y, at rate 1."""
    if rule == POSTSYNAPTIC:
        return w * (x - ONE) * y + (ONE - w) * x * y
    if rule == PRESYNAPTIC:
        return w * x * (y - ONE) + (ONE - w) * x * y
    if rule == COVARIANCE:
        # f is F of the formula, because tanh(a) = 2 sigmoid(2 a) - 1.
        f = TWO * sigmoid(TWO * (FOUR * (ONE - abs(x - y)) - TWO)) - ONE
        return choose(f > ZERO, (ONE - w) * f, w * f)
    # HEBB. `ZERO * w` gives the result the type of w.
    return (ONE - w) * x * y + ZERO * w


class _StrengthRule(SynapticRule):
    """Base of the rules of strengths. `compute_change` returns the change of a strength."""

    # [weight, lane]: sign of a weight at birth, 1 or -1.
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
        """Change the strength of a weight, within [0, 1]."""
        sign = get(part.signs, synapse.number, lane)
        strength = synapse.weight * sign
        strength_synapse = Synapse(synapse.number, strength, synapse.x, synapse.y, synapse.rate)
        change = compute_change(part, state, strength_synapse, lane)
        strength = strength + synapse.rate * change
        # Rounding can exceed the limits.
        strength = choose(strength < ZERO, ZERO, choose(strength > ONE, ONE, strength))
        put(state.weights, synapse.number, lane, sign * strength)


def _change_by(rule: int) -> Any:
    """Return the hook `compute_change` of a rule, such as `HEBB`."""

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


# Modules of the genome that contain the coefficients.
COEFFICIENT_MODULES: Final = ("A", "B", "C", "D")
N_COEFFICIENTS: Final = len(COEFFICIENT_MODULES)


class _FixedCoefficients(SynapticRule):
    """Base of the rules with coefficients as fields."""

    a: float = Field(
        1.0, ge=-1, le=1, description="A, coefficient of the product of both activations."
    )
    b: float = Field(0.0, ge=-1, le=1, description="B, coefficient of the source activation.")
    c: float = Field(0.0, ge=-1, le=1, description="C, coefficient of the target activation.")
    d: float = Field(0.0, ge=-1, le=1, description="D, constant term.")

    @staticmethod
    def compute_change(part: Any, state: State, synapse: Synapse, lane: Lane) -> Value:
        x = synapse.x
        y = synapse.y
        return part.a * x * y + part.b * x + part.c * y + part.d


class ABCD(_FixedCoefficients, name="abcd"):
    """Weight changes rate * (A x y + B x + C y + D), for a source x and a target y of the weight.

    Weights are limited to [-10, 10].

    References
    ----------
    Soltoggio et al. 2008.
    """


class Modulated(_FixedCoefficients, name="modulated"):
    """As `abcd`, with a factor in [-1, 1] that an inherited network computes in each step.

    References
    ----------
    Soltoggio et al. 2008.
    """

    modules: ClassVar[tuple[str, ...]] = ("action", "reinforcement")
    answers: ClassVar[tuple[str, ...]] = ("gate",)

    @staticmethod
    def learn(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
        # The gate is in [-1, 1]. With the logistic output y, 2 y - 1 equals tanh(s / 2).
        gate = TWO * get(state.targets, 0, lane) - ONE
        for_each_synapse(part, state, get(state.rate, 0, lane) * gate, lane)


class _EvolvedCoefficients(SynapticRule):
    """Base of the rules with coefficients as genes: the last four modules of the genome."""

    encoding: Literal["network", "connection"] = Field(
        "network",
        description=(
            "Genes of the coefficients. network: one gene for all weights; "
            "connection: one gene per weight."
        ),
    )
    # "a" to "d" [weight, lane]: coefficients, in [-1, 1].
    arrays: ClassVar[Mapping[str, Array]] = {name: per_agent("weights") for name in "abcd"}
    derived: ClassVar[Mapping[str, Any]] = {
        **SynapticRule.derived,
        "is_per_connection": lambda part, experiment: part.encoding == "connection",
    }

    @staticmethod
    def load_genes(part: Any, model: MiniWorldModel, state: State, genes: Any, lane: Lane) -> None:
        weights = state.weights.shape[0]
        # The coefficient modules are the last modules of the genome.
        first_gene = genes.shape[0] - N_COEFFICIENTS * weights
        for weight in range(weights):
            gene = first_gene + (weight if part.is_per_connection else 0)
            put(part.a, weight, lane, clamp(get(genes, gene, lane), ONE))
            put(part.b, weight, lane, clamp(get(genes, gene + weights, lane), ONE))
            put(part.c, weight, lane, clamp(get(genes, gene + 2 * weights, lane), ONE))
            put(part.d, weight, lane, clamp(get(genes, gene + 3 * weights, lane), ONE))

    @staticmethod
    def compute_change(part: Any, state: State, synapse: Synapse, lane: Lane) -> Value:
        weight = synapse.number
        x = synapse.x
        y = synapse.y
        change = get(part.a, weight, lane) * x * y + get(part.b, weight, lane) * x
        return change + get(part.c, weight, lane) * y + get(part.d, weight, lane)


class EvolvedABCD(_EvolvedCoefficients, name="evolved-abcd"):
    """As `abcd`, with inherited coefficients A, B, C and D.

    With `encoding = "network"`, all weights have the same coefficients.
    With `encoding = "connection"`, each weight has separate coefficients.

    References
    ----------
    Niv et al. 2002; Najarro and Risi 2020.
    """

    modules: ClassVar[tuple[str, ...]] = ("action", *COEFFICIENT_MODULES)


class EvolvedModulated(_EvolvedCoefficients, name="evolved-modulated"):
    """As `modulated`, with inherited coefficients A, B, C and D.

    References
    ----------
    Soltoggio et al. 2008.
    """

    modules: ClassVar[tuple[str, ...]] = ("action", "reinforcement", *COEFFICIENT_MODULES)
    answers: ClassVar[tuple[str, ...]] = Modulated.answers

    learn = staticmethod(Modulated.learn)
