"""Learning rules with coefficients: a weight changes by rate * (A x y + B x + C y + D).

x and y are the activations of the source and target unit.
The coefficients of `abcd` are fields. Those of `evolved-abcd` are genes: the genome has one module
for each of A, B, C and D in addition to the weights.
`modulated` and `evolved-modulated` multiply the changes by a gate in [-1, 1].
An inherited network, fixed for life, computes the gate in every step.

Our interpretation:

- A gene of N(0, 1) is a coefficient, limited to [-1, 1].
- With `encoding = "network"`, the first gene of a module applies to all weights, as in Niv et al.
  With `encoding = "connection"`, each weight has its own gene, as in Najarro and Risi.
- One gate applies to the complete network: m = tanh(s / 2), with s the total input of the first
  output of the reinforcement module. In the paper, each neuron has its
  own m, from modulatory neurons.
- The rate is `learning.rate`, or a gene with `learning.evolved_rate`.

Sources:

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

from pydantic import Field

from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import ONE, TWO, Lane, Value, clamp, get, put
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.learning_rules import Synapse, SynapticRule, for_each_synapse

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
    # Coefficients, in [-1, 1].
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
