"""The kind of part that changes the weights of an agent during its lifetime, and its hooks."""

from __future__ import annotations

from typing import Any, ClassVar

from baldwinlab.engine.phases import hook
from baldwinlab.engine.simd import Lane
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
        Arrays of the step, and the other parts.
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
        Arrays of the step, and the other parts.
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
        Arrays of the step, and the other parts.
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
        Arrays of the step, and the other parts.
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
        Names of the outputs of the reinforcement module. Empty if the outputs are those of the
        action module.
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
