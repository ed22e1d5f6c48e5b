"""The kind of part that performs the actions of an agent, and the hooks of this kind."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.phases import hook
from baldwinlab.engine.simd import Lane, choose, get, put
from baldwinlab.parts.part import Part


@hook
def choose_action(part: Any, model: Any, state: Any, lane: Lane) -> None:
    """Write the chosen action to `state.action` [1, lane].

    Per agent, once per step, after the network has computed its outputs. The default action is the
    index of the largest output. If several outputs are largest, the action is the lowest index of
    these outputs.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    lane : Lane
        Column of an agent, or a SIMD block.
    """
    # There is a target for each output, and the outputs are the last rows of the activations.
    actions = state.targets.shape[0]
    first = state.activations.shape[0] - actions
    largest = get(state.activations, first, lane)
    put(state.action, 0, lane, np.float32(0))
    for number in range(1, actions):
        output = get(state.activations, first + number, lane)
        is_larger = output > largest
        action = choose(is_larger, np.float32(number), get(state.action, 0, lane))
        put(state.action, 0, lane, action)
        largest = choose(is_larger, output, largest)


@hook
def move(part: Any, model: Any, state: Any, lane: Lane) -> None:
    """Turn and move the agent by its action.

    Per agent, once per step, after `choose_action`. The hook reads `state.action`, and writes
    `state.heading` and `state.positions`. The default hook does nothing.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


class Body(Part):
    """Body of an agent, which defines its actions and its movement.

    Attributes
    ----------
    actions : tuple of str
        Names of the actions. The network has one output per action.
    stride : float
        Maximum distance of a step, in units of length.
    chooses : bool
        True if an agent performs one action per step. False if the body uses all outputs.
    """

    kind: ClassVar[str] = "body"
    actions: ClassVar[tuple[str, ...]] = ()
    stride: ClassVar[float] = 2.0
    chooses: ClassVar[bool] = True

    choose_action: ClassVar[Any] = staticmethod(choose_action.default)
    move: ClassVar[Any] = staticmethod(move.default)
