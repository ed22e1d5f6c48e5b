"""What follows from the inputs alone: looked up, while there are few inputs, all binary, and the network has no memory.

A module of the genome that does not change in life is a table of answers, one for each combination of inputs, made at birth: the
reinforcement module, and the action module of agents that do not learn. Where a table would be too large, or the network has
a memory, the module is asked in every step. Which of these holds is a type, so the step is compiled for it.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.phases import Array, hook, per_agent, per_lane
from baldwinlab.engine.simd import Lane, first_lane, get, lanes_of, put
from baldwinlab.models.miniworld.state import Model, State
from baldwinlab.parts.agent_parts import forward

MAX_TABLE_INPUTS: Final = 6  # a table of 64 answers


@hook
def fill_table(part: Any, model: Model, state: State, fixed: Any, lane: Lane) -> None:
    """At birth: what the module answers whose weights are the first of `fixed` [weight, lane]."""


@hook
def look_up_outputs(part: Any, model: Model, state: State, lane: int) -> None:
    """When an agent has looked: look up what follows from its inputs."""


@hook
def compute_outputs(part: Any, model: Model, state: State, lane: Lane) -> None:
    """In every step: the action module's outputs."""
    forward(state.network, state.weights, state.activations, lane)


class DirectEvaluation:
    """Nothing is looked up, and there is no reinforcement module."""

    arrays: ClassVar[dict[str, Array]] = {}
    Compiled: ClassVar[Any]
    fill_table = staticmethod(fill_table.default)
    look_up_outputs = staticmethod(look_up_outputs.default)
    compute_outputs = staticmethod(compute_outputs.default)


class _LookupTable(DirectEvaluation):
    arrays: ClassVar[dict[str, Array]] = {"answers": per_lane("answers")}  # code * actions + action

    @staticmethod
    def fill_table(part: Any, model: Model, state: State, fixed: Any, lane: Lane) -> None:
        actions = state.targets.shape[0]
        outputs = state.activations.shape[0] - actions
        for code in range(1 << model.inputs):
            for k in range(model.inputs):
                put(state.activations, k, lane, np.float32((code >> k) & 1))
            forward(state.network, fixed, state.activations, lane)
            for one in range(first_lane(lane), first_lane(lane) + lanes_of(lane)):
                for k in range(actions):
                    put(
                        part.answers,
                        one,
                        code * actions + k,
                        get(state.activations, outputs + k, one),
                    )


class TeacherTable(_LookupTable):
    """The reinforcement module's answers are the targets."""

    @staticmethod
    def look_up_outputs(part: Any, model: Model, state: State, lane: int) -> None:
        actions = state.targets.shape[0]
        for k in range(actions):
            put(
                state.targets,
                k,
                lane,
                get(part.answers, lane, get(state.code, 0, lane) * actions + k),
            )


class ActionTable(_LookupTable):
    """The action module's own answers: of an agent that does not learn, so that it need not think."""

    @staticmethod
    def look_up_outputs(part: Any, model: Model, state: State, lane: int) -> None:
        actions = state.targets.shape[0]
        outputs = state.activations.shape[0] - actions
        for k in range(actions):
            put(
                state.activations,
                outputs + k,
                lane,
                get(part.answers, lane, get(state.code, 0, lane) * actions + k),
            )

    @staticmethod
    def compute_outputs(part: Any, model: Model, state: State, lane: Lane) -> None:
        """It has been looked up."""


class DirectTeacher(DirectEvaluation):
    """The reinforcement module is asked in every step, and may have a memory of its own."""

    arrays: ClassVar[dict[str, Array]] = {
        "weights": per_agent("weights"),
        "activations": per_agent("units"),
    }

    @staticmethod
    def fill_table(part: Any, model: Model, state: State, fixed: Any, lane: Lane) -> None:
        for weight in range(state.weights.shape[0]):
            put(part.weights, weight, lane, get(fixed, weight, lane))
        for unit in range(state.activations.shape[0]):
            put(part.activations, unit, lane, np.float32(0))

    @staticmethod
    def compute_outputs(part: Any, model: Model, state: State, lane: Lane) -> None:
        forward(state.network, state.weights, state.activations, lane)
        for k in range(model.inputs):
            put(part.activations, k, lane, get(state.activations, k, lane))
        forward(state.network, part.weights, part.activations, lane)
        actions = state.targets.shape[0]
        for k in range(actions):
            put(
                state.targets,
                k,
                lane,
                get(part.activations, state.activations.shape[0] - actions + k, lane),
            )


def choose_lookup(experiment: Any) -> type[DirectEvaluation]:
    """What is looked up in an experiment's lives."""
    few = (
        len(experiment.inputs) <= MAX_TABLE_INPUTS
        and not experiment.real_valued
        and experiment.part("network.kind").is_memoryless
    )
    taught = "reinforcement" in experiment.modules
    if taught:
        return TeacherTable if few else DirectTeacher
    return ActionTable if few and not experiment.learns else DirectEvaluation


def _make_tuple_type(kind: type[DirectEvaluation]) -> Any:
    made: Any = namedtuple("Compiled", list(kind.arrays))  # type: ignore[misc]
    made.__module__, made.__qualname__ = __name__, f"{kind.__name__}.Compiled"
    setattr(made, "part", kind)  # noqa: B010
    return made


for _kind in (DirectEvaluation, TeacherTable, ActionTable, DirectTeacher):
    _kind.Compiled = _make_tuple_type(_kind)
