"""The kind of part that adds items, walls or changes to the world, and its hooks."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.phases import hook
from baldwinlab.engine.simd import Mask, Value
from baldwinlab.experiment.fields import Fields
from baldwinlab.parts.part import Part

ZERO = np.float32(0)
ONE = np.float32(1)


@hook
def init_world(part: Any, model: Any, state: Any, world: int) -> None:
    """Initialize the arrays of the part for a world.

    Per world, at the beginning of a lifetime, before agents and items are placed.

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
    """


@hook
def blocks_placement(part: Any, model: Any, x: np.float32, y: np.float32) -> bool:
    """Return whether agents and items cannot be placed at a position.

    Called for each candidate position of a newborn or an item. It writes nothing.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    x, y : float32
        Position, in units of length. y points down.

    Returns
    -------
    bool
        True if the position is blocked. False by default.
    """
    return False


@hook
def blocks_sight(part: Any, model: Any, x: np.float32, y: np.float32, dx: Value, dy: Value) -> Mask:
    """Return whether an item or agent cannot be seen.

    Per agent, for each seen candidate. It writes nothing.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    x, y : float32
        Position of the agent, in units of length. y points down.
    dx, dy : float32, or a SIMD block
        Offset of the seen item or agent.

    Returns
    -------
    bool, or a mask
        True where the view from (x, y) to (x + dx, y + dy) is blocked. False by default.
    """
    # False, as a bool or as a mask.
    return dx * ZERO > ONE


@hook
def blocks_movement(part: Any, model: Any, x: Value, y: Value) -> Mask:
    """Return whether an agent cannot enter a position.

    Per agent, when it moves. An agent that tries stays at its position. It writes nothing.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    x, y : float32, or a SIMD block
        New position, in units of length. y points down.

    Returns
    -------
    bool, or a mask
        True where the position cannot be entered. False by default.
    """
    return x * ZERO > ONE


@hook
def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Change the world at the end of a step.

    Per world, after all agents have eaten. It may write the arrays of the part, items and agents
    of the world.

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


class ItemRegion(Fields):
    """Rectangle with uniformly placed items. An eaten item reappears in its region at once.

    Attributes
    ----------
    kind : str
        Kind of the items, such as "food".
    x, y : (float, float)
        Left and right, upper and lower edge, in units of length.
    count : int
        Number of items.
    energy : float
        Energy of an item.
    color : str
        Color of the items, a name of the palette or "#rrggbb".
    """

    kind: str
    x: tuple[float, float]
    y: tuple[float, float]
    count: int
    energy: float
    color: str


class WorldFeature(Part):
    """Feature of the world: items, walls, and changes over time.

    Attributes
    ----------
    allows_births : bool
        True if agents are born during a lifetime.
    """

    kind: ClassVar[str] = "world feature"
    allows_births: ClassVar[bool] = False

    def items(self) -> tuple[ItemRegion, ...]:
        """Return the regions of items that the feature adds to the food of the world."""
        return ()

    def map_shapes(self) -> tuple[dict[str, Any], ...]:
        """Return the shapes of the feature on drawn maps.

        Returns
        -------
        tuple of dict
            {"shape": "rectangle", "x": (left, right), "y": (upper, lower), "color", "label"}
        """
        return ()

    init_world: ClassVar[Any] = staticmethod(init_world.default)
    blocks_placement: ClassVar[Any] = staticmethod(blocks_placement.default)
    blocks_sight: ClassVar[Any] = staticmethod(blocks_sight.default)
    blocks_movement: ClassVar[Any] = staticmethod(blocks_movement.default)
    end_step: ClassVar[Any] = staticmethod(end_step.default)
