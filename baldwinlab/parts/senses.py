"""The kind of part that computes the inputs of an agent, and its hooks."""

from __future__ import annotations

from typing import Any, ClassVar

from baldwinlab.engine.phases import hook
from baldwinlab.parts.part import Part


@hook
def sense(part: Any, model: Any, state: Any, world: int, agent: int) -> int:
    """Return the inputs of a binary sense as bits.

    Per agent, once per step. The engine calls it if `is_continuous` is false.

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

    Returns
    -------
    int
        Bit k is 1 if input k is on. Input 0 is the lowest bit.
    """
    return 0


@hook
def measure(part: Any, model: Any, state: Any, world: int, agent: int, first: int) -> None:
    """Write the inputs of a continuous sense.

    Per agent, once per step. The engine calls it if `is_continuous` is true. The hook writes rows
    `first`, `first + 1`, ... of `state.activations`, float32 in [0, 1]. It may also write the
    arrays of the part.

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
    first : int
        Row of the first input of the part in `state.activations`.
    """


@hook
def prepare_senses(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Compute data about other agents before the agents sense.

    Per world, at the beginning of every step. The hook may write the arrays of the part and the
    per-agent arrays of `state`.

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


class Sense(Part):
    """Sense of an agent, which writes inputs of its network.

    An input of a binary sense is 0 or 1. An input of a continuous sense is a real number in [0, 1].

    Attributes
    ----------
    inputs : tuple of str
        Names of the inputs.
    sectors : tuple of (float, float) or None
        Angular range of each input, in degrees clockwise from the heading. The lab and the figures
        draw it. None for an input without a range.
    item_kind : str
        Kind of the items that the sense detects. "" means food.
    only_items : bool
        True if the inputs depend on items alone. If this holds for all senses, the engine skips
        them for an agent without a nearby item.
    is_continuous : bool
        True if `measure` writes the inputs, False if `sense` returns them as bits.
    """

    kind: ClassVar[str] = "sense"
    inputs: ClassVar[tuple[str, ...]] = ()
    sectors: ClassVar[tuple[tuple[float, float] | None, ...]] = ()
    item_kind: ClassVar[str] = ""
    only_items: ClassVar[bool] = False
    is_continuous: ClassVar[bool] = False

    sense: ClassVar[Any] = staticmethod(sense.default)
    measure: ClassVar[Any] = staticmethod(measure.default)
    prepare_senses: ClassVar[Any] = staticmethod(prepare_senses.default)
