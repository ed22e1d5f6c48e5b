"""Plasticity with coefficients: a weight changes by rate * (A x y + B x + C y + D), with x what comes in and y what goes out.

`abcd` has the coefficients as fields, `evolved-abcd` as genes: the genome holds, beside the weights, a module for each of A, B, C
and D. `modulated` and `evolved-modulated` are the same, gated: an inherited network, fixed for life, says in every step how
much of the change is made, from all of it (1) over nothing (0) to its reverse (-1).

Readings of ours: a gene of N(0, 1) is a coefficient as it stands, but at most 1 and at least -1; of a module of coefficients the
first gene is that of all connections (as there), or each is that of its own (as in Najarro and Risi); the gate is one for the
whole network, m = tanh(s / 2) with s what the first output of the reinforcement module sums up (there, each neuron has an m
of its own from the modulatory neurons that reach it). The rate is `learning.rate`, or a gene by `learning.evolved_rate`.

Sources: Y. Niv, D. Joel, I. Meilijson and E. Ruppin, "Evolution of reinforcement learning in uncertain environments", Adaptive
Behavior 10 (2002); A. Soltoggio, J. A. Bullinaria, C. Mattiussi, P. Duerr and D. Floreano, "Evolutionary advantages of
neuromodulated plasticity in dynamic, reward-based scenarios", ALIFE XI (2008); E. Najarro and S. Risi, "Meta-learning
through Hebbian plasticity in random networks", NeurIPS 33 (2020).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import repeat
from typing import Any, ClassVar, Final, Literal

import numpy as np
from pydantic import Field

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, hook, per_agent
from baldwinlab.engine.simd import Lane, Value, clamp, get, put
from baldwinlab.models.miniworld.learning.hebbian import LAYERS
from baldwinlab.models.miniworld.learning.oracle_synapses import list_synapses
from baldwinlab.models.miniworld.state import Model, State
from baldwinlab.parts.agent_parts import LearningRule

ZERO, ONE, TWO = np.float32(0), np.float32(1), np.float32(2)
LIMIT = np.float32(10)  # of weights, either way
COEFFICIENTS: Final = ("A", "B", "C", "D")  # the modules of a genome that hold them


@compiled
def _gate_value(state: State, lane: Lane) -> Value:
    """How much of a change is made, in [-1, 1]: 2 y - 1 of a logistic output y is tanh(s / 2) of what it sums up."""
    return TWO * get(state.targets, 0, lane) - ONE


@hook
def compute_change(part: Any, weight: int, x: Value, y: Value, lane: Lane) -> Any:
    """How fast a weight changes between units that are at x and y."""


@compiled
def _update_weights(part: Any, state: State, rate: Value, lane: Lane) -> None:
    """Change every weight by its coefficients, from the inputs' layer on."""
    source, weight = 0, 0
    for layer in range(part.sizes.size - 1):
        inputs, outputs = part.sizes[layer], part.sizes[layer + 1]
        for i in range(inputs + int(part.biases)):
            for unit in range(outputs):
                y = get(state.activations, source + inputs + unit, lane)
                x = (
                    get(state.activations, source + i, lane) if i < inputs else y * ZERO + ONE
                )  # a bias is as if from a 1
                faster = compute_change(part, weight, x, y, lane)
                put(
                    state.weights,
                    weight,
                    lane,
                    clamp(get(state.weights, weight, lane) + rate * faster, LIMIT),
                )
                weight += 1
        source += inputs


def _oracle_change(part: Any, agent: Any, naive: Any, gate: float = 1.0) -> None:
    """The oracle of all four."""
    inherited = "a" in agent.own
    of_all = [float(each) for each in (part.a, part.b, part.c, part.d)] if not inherited else []
    of_each = (
        zip(*(agent.own[name] for name in "abcd"), strict=True) if inherited else repeat(of_all)
    )
    for (row, unit, x, y), (a, b, c, d) in zip(
        list_synapses(naive, agent), of_each, strict=inherited
    ):
        row[unit] = min(
            max(row[unit] + agent.rate * gate * (a * x * y + b * x + c * y + d), -10.0), 10.0
        )


def _oracle_gate(agent: Any, naive: Any) -> float:
    return float(2 * naive.think(agent.reinforcement_module, agent.inputs)[0] - 1)


class _FixedCoefficients(LearningRule):
    """Coefficients as fields."""

    a: float = Field(
        1.0, ge=-1, le=1, description="A, coefficient of the product of both activations."
    )
    b: float = Field(0.0, ge=-1, le=1, description="B, coefficient of the source activation.")
    c: float = Field(0.0, ge=-1, le=1, description="C, coefficient of the target activation.")
    d: float = Field(0.0, ge=-1, le=1, description="D, constant term.")
    derived: ClassVar[Mapping[str, Any]] = LAYERS

    @staticmethod
    def compute_change(part: Any, weight: int, x: Value, y: Value, lane: Lane) -> Any:
        return part.a * x * y + part.b * x + part.c * y + part.d


class ABCD(_FixedCoefficients, name="abcd"):
    """Weight change rate * (A x y + B x + C y + D), x before and y after the weight.

    Weights stay within [-10, 10].

    References
    ----------
    Soltoggio et al. 2008.
    """

    @staticmethod
    def learn(part: Any, model: Model, state: State, step: int, lane: Lane) -> None:
        _update_weights(part, state, get(state.rate, 0, lane), lane)

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        _oracle_change(part, agent, naive)


class Modulated(_FixedCoefficients, name="modulated"):
    """As `abcd`, with a factor in [-1, 1] that an inherited network computes in each step.

    References
    ----------
    Soltoggio et al. 2008.
    """

    modules: ClassVar[tuple[str, ...]] = ("action", "reinforcement")
    answers: ClassVar[tuple[str, ...]] = ("gate",)

    @staticmethod
    def learn(part: Any, model: Model, state: State, step: int, lane: Lane) -> None:
        _update_weights(part, state, get(state.rate, 0, lane) * _gate_value(state, lane), lane)

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        _oracle_change(part, agent, naive, _oracle_gate(agent, naive))


class _EvolvedCoefficients(LearningRule):
    """Coefficients as genes: the last four modules of the genome."""

    encoding: Literal["network", "connection"] = Field(
        "network",
        description=(
            "Genes of the coefficients. network: one gene for all weights; "
            "connection: one gene per weight."
        ),
    )
    arrays: ClassVar[Mapping[str, Array]] = {
        name: per_agent("weights") for name in "abcd"
    }  # coefficients, in [-1, 1]
    derived: ClassVar[Mapping[str, Any]] = {
        **LAYERS,
        "of_each": lambda part, experiment: part.encoding == "connection",
    }

    @staticmethod
    def load_genes(part: Any, model: Model, state: State, genes: Any, lane: Lane) -> None:
        weights = state.weights.shape[0]
        first = genes.shape[0] - 4 * weights
        for weight in range(weights):
            gene = first + (weight if part.of_each else 0)
            put(part.a, weight, lane, clamp(get(genes, gene, lane), ONE))
            put(part.b, weight, lane, clamp(get(genes, gene + weights, lane), ONE))
            put(part.c, weight, lane, clamp(get(genes, gene + 2 * weights, lane), ONE))
            put(part.d, weight, lane, clamp(get(genes, gene + 3 * weights, lane), ONE))

    @staticmethod
    def compute_change(part: Any, weight: int, x: Value, y: Value, lane: Lane) -> Any:
        faster = get(part.a, weight, lane) * x * y + get(part.b, weight, lane) * x
        return faster + get(part.c, weight, lane) * y + get(part.d, weight, lane)


class EvolvedABCD(_EvolvedCoefficients, name="evolved-abcd"):
    """As `abcd`, with inherited coefficients A, B, C and D.

    With `encoding = "network"` all weights share them; with `encoding = "connection"` each weight has
    its own.

    References
    ----------
    Niv et al. 2002; Najarro and Risi 2020.
    """

    modules: ClassVar[tuple[str, ...]] = ("action", *COEFFICIENTS)

    @staticmethod
    def learn(part: Any, model: Model, state: State, step: int, lane: Lane) -> None:
        _update_weights(part, state, get(state.rate, 0, lane), lane)

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        _oracle_change(part, agent, naive)


class EvolvedModulated(_EvolvedCoefficients, name="evolved-modulated"):
    """As `modulated`, with inherited coefficients A, B, C and D.

    References
    ----------
    Soltoggio et al. 2008.
    """

    modules: ClassVar[tuple[str, ...]] = ("action", "reinforcement", *COEFFICIENTS)
    answers: ClassVar[tuple[str, ...]] = ("gate",)

    @staticmethod
    def learn(part: Any, model: Model, state: State, step: int, lane: Lane) -> None:
        _update_weights(part, state, get(state.rate, 0, lane) * _gate_value(state, lane), lane)

    @staticmethod
    def oracle(part: Any, agents: Any, agent: Any, naive: Any) -> None:
        _oracle_change(part, agent, naive, _oracle_gate(agent, naive))
