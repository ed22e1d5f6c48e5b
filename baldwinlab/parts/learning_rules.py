"""The kind of part that changes the weights of an agent during a lifetime, and the hooks.

A *synapse* is a weight of the action module, with a source unit and a target unit.
`SynapticRule` calls `compute_change` for every synapse. A Hebbian rule is then one expression:

    class Oja(SynapticRule, name="oja"):
        @staticmethod
        def compute_change(part, state, synapse, lane):
            return synapse.y * (synapse.x - synapse.y * synapse.weight)
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook
from baldwinlab.engine.simd import ONE, ZERO, Lane, Value, clamp, get, put
from baldwinlab.parts.part import Part


@hook
def load_genes(part: Any, model: Any, state: Any, genes: Any, lane: Lane) -> None:
    """Store the genes of the modules after the action module in the arrays of the part.

    Per agent, at birth, before `init_agent`. `state.weights` already contains the action module.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    genes : array, float32 [gene, lane]
        Weights of all modules after the action module, in the order of the modules. Read only.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


@hook
def init_agent(part: Any, model: Any, state: Any, world: int, agent: int) -> None:
    """Initialize the arrays of the part for a newborn agent.

    Per agent, at birth, after `load_genes`. `state` already contains the position, heading and
    weights of the agent. The hook may write the column of the agent in the arrays of the part and
    in `state`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    world, agent : int
        Indices of the world and of the agent in it. The lane is `world * model.agents + agent`.
    """


@hook
def observe_others(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Compute data about other agents before the agents learn.

    Per world, once per step, after all agents have acted. The hook may read all agents. It may
    write the arrays of the part and the per-agent arrays of `state`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    world : int
        Index of the world.
    step : int
        Step of the lifetime, from 0.
    """


@hook
def learn(part: Any, model: Any, state: Any, step: int, lane: Lane) -> None:
    """Change the weights of an agent.

    Per agent, once per step, after `observe_others`. The engine calls it during the first
    `learning.steps` steps of an agent. The hook writes `state.weights` and the column of the
    agent in the arrays of the part.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    step : int
        Step of the lifetime, from 0.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


class LearningRule(Part):
    """Learning rule, which changes the weights of an agent during its lifetime.

    Attributes
    ----------
    modules : tuple of str
        Names of the modules of a genome. All modules have the same size. The first module is
        "action". If the second module is "reinforcement", it contains the weights of a second
        network. The engine writes the outputs of this network to `state.targets` in each step.
    learns : bool
        False for a rule that changes no weights.
    supports_drift_control : bool
        True if the rule changes weights by the same amount as self-teaching. The assay `innate`
        then simulates `self-taught` with `control = "drift"` as a control of this rule.
    answers : tuple of str
        Names of the outputs of the reinforcement module. Empty if these are the names of the
        outputs of the action module.
    teacher_array : str
        Name of the int array of the part with the index of each agent's teacher. The entry of an
        agent without a teacher is the index of this agent. "" for a rule without teachers.
    color : str
        Color of the rule in figures, a name of `baldwinlab.analysis.palette`.
    """

    kind: ClassVar[str] = "learning rule"
    modules: ClassVar[tuple[str, ...]] = ("action",)
    learns: ClassVar[bool] = True
    supports_drift_control: ClassVar[bool] = False
    answers: ClassVar[tuple[str, ...]] = ()
    teacher_array: ClassVar[str] = ""
    color: ClassVar[str] = "blue"

    load_genes: ClassVar[Any] = staticmethod(load_genes.default)
    init_agent: ClassVar[Any] = staticmethod(init_agent.default)
    observe_others: ClassVar[Any] = staticmethod(observe_others.default)
    learn: ClassVar[Any] = staticmethod(learn.default)


MAX_WEIGHT = np.float32(10)
"""Maximum absolute value of a weight that a `SynapticRule` changes."""
LAYER_VALUES: Final[Mapping[str, Any]] = {
    "sizes": lambda part, experiment: np.array(experiment.layer_sizes, np.int64),
    "biases": lambda part, experiment: experiment.network.biases,
}
"""Derived values of a part that calls `for_each_synapse`."""


class Synapse(NamedTuple):
    """A weight of the action module, and the activations of the two connected units.

    Attributes
    ----------
    number : int
        Index of the weight, which is the row in `state.weights`.
    weight : float32, or a SIMD block
        The weight.
    x, y : float32, or a SIMD block
        Activations of the source unit and of the target unit. The source of a bias has the
        activation 1.
    rate : float32, or a SIMD block
        Factor of the change: the learning rate of the agent, or the rate of `for_each_synapse`.
    """

    number: int
    weight: Value
    x: Value
    y: Value
    rate: Value


@hook
def compute_change(part: Any, state: Any, synapse: Synapse, lane: Lane) -> Value:
    """Return the change of a weight, per learning rate.

    Per agent, for each synapse in each step in which the agent learns.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    state : State
        Arrays that a step changes, and the compiled parts.
    synapse : Synapse
        The weight and its activations.
    lane : Lane
        Column of an agent, or a SIMD block.

    Returns
    -------
    float32, or a SIMD block
        The change before it is multiplied by `synapse.rate`. 0 by default.
    """
    # The result is 0 in the type of the weight.
    return ZERO * synapse.weight


@hook
def change_synapse(part: Any, state: Any, synapse: Synapse, lane: Lane) -> None:
    """Change a weight by `synapse.rate * compute_change(...)`.

    Per agent, for each synapse. By default, the new weight is limited to [-10, 10].

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    state : State
        Arrays that a step changes, and the compiled parts.
    synapse : Synapse
        The weight and its activations.
    lane : Lane
        Column of an agent, or a SIMD block.
    """
    change = compute_change(part, state, synapse, lane)
    weight = clamp(synapse.weight + synapse.rate * change, MAX_WEIGHT)
    put(state.weights, synapse.number, lane, weight)


@compiled
def for_each_synapse(part: Any, state: Any, rate: Value, lane: Lane) -> None:
    """Call `change_synapse` of a rule for each weight of the action module, layer by layer.

    Parameters
    ----------
    part : NamedTuple
        The first argument of a hook of a `SynapticRule`.
    state : State
        Arrays that a step changes, and the compiled parts.
    rate : float32, or a SIMD block
        Factor of the changes, for example `get(state.rate, 0, lane)`.
    lane : Lane
        Column of an agent, or a SIMD block.
    """
    # Row of the first source unit of a layer in `state.activations`.
    source = 0
    number = 0
    for layer in range(part.sizes.size - 1):
        inputs = part.sizes[layer]
        outputs = part.sizes[layer + 1]
        for i in range(inputs + int(part.biases)):
            for unit in range(outputs):
                y = get(state.activations, source + inputs + unit, lane)
                # A bias has the activation 1, in the type of `y`: a float32 or a SIMD block.
                x = get(state.activations, source + i, lane) if i < inputs else y * ZERO + ONE
                weight = get(state.weights, number, lane)
                change_synapse(part, state, Synapse(number, weight, x, y, rate), lane)
                number += 1
        source += inputs


class SynapticRule(LearningRule):
    """Base of the learning rules that change each weight by an expression of the activations.

    A rule defines the hook `compute_change`. Weights are limited to [-10, 10]. A rule with other
    limits defines the hook `change_synapse`. A rule with other derived values includes those of
    this class: `derived = {**SynapticRule.derived, ...}`.
    """

    adds_hooks: ClassVar[bool] = True
    derived: ClassVar[Mapping[str, Any]] = LAYER_VALUES

    compute_change: ClassVar[Any] = staticmethod(compute_change.default)
    change_synapse: ClassVar[Any] = staticmethod(change_synapse.default)

    @staticmethod
    def learn(part: Any, model: Any, state: Any, step: int, lane: Lane) -> None:
        """Call `change_synapse` for each weight, with the learning rate of the agent.

        Parameters
        ----------
        part : NamedTuple
            Numeric settings, derived values and arrays of the part.
        model : MiniWorldModel
            Constants of the lifetime. Read only.
        state : State
            Arrays that a step changes, and the compiled parts.
        step : int
            Step of the lifetime, from 0.
        lane : int, or a SIMD block
            Column of the agent.
        """
        for_each_synapse(part, state, get(state.rate, 0, lane), lane)
