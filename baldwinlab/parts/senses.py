"""The kind of part that computes the inputs of an agent, and the hooks of this kind."""

from __future__ import annotations

from typing import Any, ClassVar

from baldwinlab.engine.jit import register
from baldwinlab.engine.phases import hook, part_class
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
        Arrays that a step changes, and the compiled parts.
    world, agent : int
        Indices of the world and of the agent in it. The lane is `world * model.agents + agent`.

    Returns
    -------
    int
        Bit k is 1 if input k is on. Input 0 is the lowest bit.
    """
    return 0


@hook
def measure(part: Any, model: Any, state: Any, world: int, agent: int) -> None:
    """Write the inputs of a continuous sense.

    Per agent, once per step. The engine calls it if `is_continuous` is true. The hook writes an
    entry of `state.activations` for each input of the part, any finite float32, from row
    `part.first_input` on. It may also write the arrays of the part.

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
        Arrays that a step changes, and the compiled parts.
    world : int
        Index of the world.
    step : int
        Step of the lifetime, from 0.
    """


def _count_inputs(part: Any) -> Any:
    """Return the number of inputs of a sense, by the first argument `part` of the hooks."""
    inputs = type(part).part.inputs
    return part.n_inputs if isinstance(inputs, property) else len(inputs)


def _choose_count_inputs(part: Any) -> Any:
    """Return the source of `_count_inputs`: a constant, or the value of the part for a property."""
    inputs = part_class(part).inputs
    if isinstance(inputs, property):
        return lambda part: part.n_inputs
    n_inputs = len(inputs)
    return lambda part: n_inputs


count_inputs = register(_count_inputs, _choose_count_inputs)


def find_first_input(part: Any, experiment: Any) -> int:
    """Return the row of the first input of a sense in `state.activations`."""
    senses = experiment.parts("senses.kinds")
    names = [sense_part.name for sense_part in senses]
    return sum(len(sense_part.inputs) for sense_part in senses[: names.index(part.name)])


class Sense(Part):
    """Sense of an agent, which writes inputs of its network.

    An input of a binary sense is 0 or 1. An input of a continuous sense is any finite number.

    If the number of inputs follows from the settings of the part, `inputs` and `sectors` are
    properties. Hooks then read the number of inputs as `part.n_inputs`.

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
        the senses of an agent without a nearby item.
    is_continuous : bool
        True if `measure` writes the inputs, False if `sense` returns them as bits. The hooks of a
        continuous sense read the row of its first input in `state.activations` as
        `part.first_input`.
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

    @classmethod
    def __pydantic_init_subclass__(cls, name: str = "", **options: Any) -> None:
        if isinstance(cls.inputs, property):
            cls.derived = {**cls.derived, "n_inputs": lambda part, experiment: len(part.inputs)}
        if cls.is_continuous:
            cls.derived = {**cls.derived, "first_input": find_first_input}
        super().__pydantic_init_subclass__(name=name, **options)
