"""Controls of learning, which apply to every rule: changes of the same size without information.

Each agent has a second action module, the *shadow*, which starts with the weights at birth. The
rule changes the shadow, from the inputs of the agent: while the hooks of the rule run,
`state.weights` and `state.activations` contain the shadow. The control then sets the weights of the
agent. `State.control` has the type of one of these classes, for which the step is compiled:

- `NoControl`: the rule changes the agent. The hooks of this class add no code.
- `DriftControl`: each weight changes by the amount of the shadow, in a random direction.
- `YokedControl`: each weight changes as in the shadow of another agent of the same world.

The drift control is described in `docs/explanation/controls.md`. The yoked control is that of
conditioning: R. M. Church, "Systematic effect of random error in the yoked control design",
Psychological Bulletin 62 (1964).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, hook, make_part_type, per_agent
from baldwinlab.engine.rng import DRIFT, philox
from baldwinlab.engine.simd import ONE, ZERO, Lane, get, put
from baldwinlab.models.miniworld.population import agent_number
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.networks import forward


@hook
def init_control(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
    """At birth, after `init_agent` of the rule: store the weights of the agent."""


@hook
def load_shadow(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
    """Before the hooks of the rule: copy the shadow to `state.weights` and `state.activations`."""


@hook
def store_shadow(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
    """After the hooks of the rule: store the shadow, and restore the activations of the agent."""


@hook
def exchange_changes(part: Any, agents: Any, model: MiniWorldModel, state: State) -> None:
    """After `store_shadow` of all agents: set weights that depend on shadows of other agents."""


class NoControl:
    """No control: the rule changes the weights of the agent."""

    arrays: ClassVar[Mapping[str, Array]] = {}
    values: ClassVar[Sequence[str]] = ()
    Compiled: ClassVar[Any]
    init_control = staticmethod(init_control.default)
    load_shadow = staticmethod(load_shadow.default)
    store_shadow = staticmethod(store_shadow.default)
    exchange_changes = staticmethod(exchange_changes.default)


class YokedControl(NoControl):
    """Each weight changes as in the shadow of the next agent of the world."""

    arrays: ClassVar[Mapping[str, Array]] = {
        "birth_weights": per_agent("weights"),
        "shadow_weights": per_agent("weights"),
        # While the hooks of the rule run, these are the activations of the agent.
        "shadow_activations": per_agent("units"),
    }

    @staticmethod
    def init_control(
        part: Any, model: MiniWorldModel, state: State, world: int, agent: int
    ) -> None:
        _init_shadow(part, state, world * model.agents + agent)

    @staticmethod
    def load_shadow(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        for weight in range(state.weights.shape[0]):
            put(state.weights, weight, lane, get(part.shadow_weights, weight, lane))
        _swap_activations(part, model, state, lane)
        forward(state.network, state.weights, state.activations, lane)

    @staticmethod
    def store_shadow(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        for weight in range(state.weights.shape[0]):
            put(part.shadow_weights, weight, lane, get(state.weights, weight, lane))
        _swap_activations(part, model, state, lane)

    @staticmethod
    def exchange_changes(part: Any, agents: Any, model: MiniWorldModel, state: State) -> None:
        end_lane = min(agents.end_lane, model.worlds * model.agents - 1)
        for weight in range(state.weights.shape[0]):
            # The compiler vectorizes this loop over all worlds. The last lane of each world gets a
            # wrong value, which the next loop corrects.
            for lane in range(agents.first_lane, end_lane):
                _copy_change(part, state, weight, lane, lane + 1)
        # The last agent of a world gets the changes of the first agent.
        for world in range(agents.first_world, agents.end_world):
            first_lane = world * model.agents
            last_lane = first_lane + model.agents - 1
            if agents.first_lane <= last_lane < agents.end_lane:
                for weight in range(state.weights.shape[0]):
                    _copy_change(part, state, weight, last_lane, first_lane)


class DriftControl(YokedControl):
    """Each weight changes by the same amount as in the shadow, in a random direction."""

    arrays: ClassVar[Mapping[str, Array]] = {
        **YokedControl.arrays,
        # 1: a weight changes in the same direction as in the shadow. -1: in the opposite direction.
        "signs": per_agent("weights"),
    }
    exchange_changes = staticmethod(exchange_changes.default)

    @staticmethod
    def init_control(
        part: Any, model: MiniWorldModel, state: State, world: int, agent: int
    ) -> None:
        """Draw the sign of each weight, and store the weights at birth."""
        lane = world * model.agents + agent
        _init_shadow(part, state, lane)
        seed = state.keys[world, 0]
        run = state.keys[world, 1]
        number = agent_number(state.population, agent)
        for weight in range(state.weights.shape[0]):
            words = philox(weight, number, state.generation[0], DRIFT, seed, run)
            is_same_direction = words[0] & np.uint32(1)
            part.signs[weight, lane] = ONE if is_same_direction else -ONE

    @staticmethod
    def store_shadow(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
        for weight in range(state.weights.shape[0]):
            shadow_weight = get(state.weights, weight, lane)
            birth_weight = get(part.birth_weights, weight, lane)
            change = shadow_weight - birth_weight
            put(part.shadow_weights, weight, lane, shadow_weight)
            put(state.weights, weight, lane, birth_weight + get(part.signs, weight, lane) * change)
        _swap_activations(part, model, state, lane)


@compiled
def _init_shadow(part: Any, state: State, lane: int) -> None:
    """Set the shadow to the weights of the agent, with the activations 0 (no memory)."""
    for weight in range(state.weights.shape[0]):
        part.birth_weights[weight, lane] = state.weights[weight, lane]
        part.shadow_weights[weight, lane] = state.weights[weight, lane]
    for unit in range(state.activations.shape[0]):
        part.shadow_activations[unit, lane] = ZERO


@compiled
def _swap_activations(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
    """Swap the activations of the agent and of the shadow. The inputs are equal, and stay."""
    for unit in range(model.inputs, state.activations.shape[0]):
        activation = get(state.activations, unit, lane)
        put(state.activations, unit, lane, get(part.shadow_activations, unit, lane))
        put(part.shadow_activations, unit, lane, activation)


@compiled
def _copy_change(part: Any, state: State, weight: int, lane: int, partner_lane: int) -> None:
    """Set a weight to the weight at birth plus the change in the shadow of `partner_lane`."""
    change = get(part.shadow_weights, weight, partner_lane) - get(
        part.birth_weights, weight, partner_lane
    )
    put(state.weights, weight, lane, get(part.birth_weights, weight, lane) + change)


CONTROLS: Final = {"none": NoControl, "drift": DriftControl, "yoked": YokedControl}

for _control in CONTROLS.values():
    make_part_type(_control, [*_control.values, *_control.arrays])


def choose_control(experiment: Any) -> type[NoControl]:
    """Return the class of the control of an experiment."""
    return CONTROLS[experiment.learning.control] if experiment.learns else NoControl
