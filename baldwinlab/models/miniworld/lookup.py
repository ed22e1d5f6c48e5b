"""Lookup tables of network outputs, for few binary inputs and networks without memory.

If the weights of a module do not change during life, a table stores the outputs of the module for
each combination of inputs. For example, the 3 binary inputs of the sense `food` have 8
combinations. The table is filled at birth, and read in each step. The reinforcement module has such
a table, and so has the action module of agents that do not learn. A module with real-valued inputs,
a memory or more than 6 inputs is evaluated in every step instead. `choose_lookup` selects one of
the classes, and the step is compiled for this class.
"""

from __future__ import annotations

from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.phases import Array, hook, make_part_type, per_agent, per_lane
from baldwinlab.engine.simd import Lane, first_lane, get, lanes_of, put
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.networks import forward

# Maximum number of inputs of a table. 6 inputs have 64 combinations.
MAX_TABLE_INPUTS: Final = 6


@hook
def fill_table(
    part: Any, model: MiniWorldModel, state: State, fixed_weights: Any, lane: Lane
) -> None:
    """At birth: prepare the module with the weights in the first rows of `fixed_weights`."""


@hook
def look_up_outputs(part: Any, model: MiniWorldModel, state: State, lane: int) -> None:
    """After sensing: look up the outputs for the inputs of an agent."""


@hook
def compute_outputs(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
    """In every step: compute the outputs of the action module."""
    forward(state.network, state.weights, state.activations, lane)


class DirectEvaluation:
    """Evaluate the action module in every step. There is no reinforcement module."""

    arrays: ClassVar[dict[str, Array]] = {}
    Compiled: ClassVar[Any]
    fill_table = staticmethod(fill_table.default)
    look_up_outputs = staticmethod(look_up_outputs.default)
    compute_outputs = staticmethod(compute_outputs.default)


class _LookupTable(DirectEvaluation):
    """Store the outputs of a module for all combinations of inputs."""

    # [lane, code * actions + action]. The bits of `code` are the inputs: 5 for the inputs 1, 0, 1.
    arrays: ClassVar[dict[str, Array]] = {"outputs": per_lane("table entries")}

    @staticmethod
    def fill_table(
        part: Any, model: MiniWorldModel, state: State, fixed_weights: Any, lane: Lane
    ) -> None:
        actions = state.targets.shape[0]
        first_output = state.activations.shape[0] - actions
        for code in range(1 << model.inputs):
            for k in range(model.inputs):
                put(state.activations, k, lane, np.float32((code >> k) & 1))
            forward(state.network, fixed_weights, state.activations, lane)
            for column in range(first_lane(lane), first_lane(lane) + lanes_of(lane)):
                for k in range(actions):
                    put(
                        part.outputs,
                        column,
                        code * actions + k,
                        get(state.activations, first_output + k, column),
                    )


class TeacherTable(_LookupTable):
    """Look up the outputs of the reinforcement module, which are the targets of learning."""

    @staticmethod
    def look_up_outputs(part: Any, model: MiniWorldModel, state: State, lane: int) -> None:
        actions = state.targets.shape[0]
        # The column of the first output in the table. `lane` is the row.
        column = get(state.code, 0, lane) * actions
        for k in range(actions):
            put(state.targets, k, lane, get(part.outputs, lane, column + k))


class ActionTable(_LookupTable):
    """Look up the outputs of the action module of an agent that does not learn."""

    @staticmethod
    def look_up_outputs(part: Any, model: MiniWorldModel, state: State, lane: int) -> None:
        actions = state.targets.shape[0]
        first_output = state.activations.shape[0] - actions
        column = get(state.code, 0, lane) * actions
        for k in range(actions):
            put(state.activations, first_output + k, lane, get(part.outputs, lane, column + k))

    @staticmethod
    def compute_outputs(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        """Do nothing, because `look_up_outputs` has set the outputs."""


class DirectTeacher(DirectEvaluation):
    """Evaluate both modules in every step. The reinforcement module can have a separate memory."""

    # Weights and activations of the reinforcement module.
    arrays: ClassVar[dict[str, Array]] = {
        "weights": per_agent("weights"),
        "activations": per_agent("units"),
    }

    @staticmethod
    def fill_table(
        part: Any, model: MiniWorldModel, state: State, fixed_weights: Any, lane: Lane
    ) -> None:
        for weight in range(state.weights.shape[0]):
            put(part.weights, weight, lane, get(fixed_weights, weight, lane))
        for unit in range(state.activations.shape[0]):
            put(part.activations, unit, lane, np.float32(0))

    @staticmethod
    def compute_outputs(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        forward(state.network, state.weights, state.activations, lane)
        for k in range(model.inputs):
            put(part.activations, k, lane, get(state.activations, k, lane))
        forward(state.network, part.weights, part.activations, lane)
        actions = state.targets.shape[0]
        first_output = state.activations.shape[0] - actions
        for k in range(actions):
            put(state.targets, k, lane, get(part.activations, first_output + k, lane))


def choose_lookup(experiment: Any) -> type[DirectEvaluation]:
    """Return the class of the lookup of an experiment."""
    fits_table = (
        len(experiment.inputs) <= MAX_TABLE_INPUTS
        and not experiment.real_valued
        and experiment.part("network.kind").is_memoryless
    )
    has_teacher = "reinforcement" in experiment.modules
    if has_teacher:
        return TeacherTable if fits_table else DirectTeacher
    return ActionTable if fits_table and not experiment.learns else DirectEvaluation


# Set the attribute `Compiled` of each class.
for _lookup_class in (DirectEvaluation, TeacherTable, ActionTable, DirectTeacher):
    make_part_type(_lookup_class, list(_lookup_class.arrays))
