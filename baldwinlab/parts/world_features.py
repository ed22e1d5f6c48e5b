"""The kind of part that adds items, walls or changes to the world, and the hooks of this kind."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

import numpy as np

from baldwinlab.engine.phases import hook
from baldwinlab.engine.simd import ONE, ZERO, Mask, Value
from baldwinlab.experiment.fields import Fields
from baldwinlab.parts.part import Part


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
        Arrays that a step changes, and the compiled parts.
    world : int
        Index of the world.
    """


@hook
def blocks_placement(part: Any, model: Any, x: np.float32, y: np.float32) -> bool:
    """Return whether agents and items cannot be placed at a position.

    The engine calls it for each candidate position of a newborn or an item. The hook writes
    nothing.

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
        True if the position is blocked. The default hook returns False.
    """
    return False


class LineOfSight(NamedTuple):
    """The line from an agent that senses to an item or to another agent.

    Attributes
    ----------
    x, y : float32
        Position of the agent that senses, in units of length. y points down.
    dx, dy : float32, or a SIMD block
        Position of the item or other agent, relative to (x, y).
    """

    x: np.float32
    y: np.float32
    dx: Value
    dy: Value


@hook
def blocks_sight(part: Any, model: Any, line: LineOfSight) -> Mask:
    """Return whether an agent cannot see an item or another agent.

    Per agent, for each item and agent within the range of a sense. The hook writes nothing.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    line : LineOfSight
        The line from the agent to the item or other agent.

    Returns
    -------
    bool, or a mask
        True if the line is blocked. The default hook returns False.
    """
    # The result is False, in the type of a comparison with `dx`: a bool or a mask.
    return line.dx * ZERO > ONE


@hook
def blocks_movement(part: Any, model: Any, x: Value, y: Value) -> Mask:
    """Return whether an agent cannot enter a position.

    Per agent, when it moves. If the new position is blocked, the agent stays at its old position.
    The hook writes nothing.

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
        True if an agent cannot enter the position. The default hook returns False.
    """
    # As in `blocks_sight`, the result is False in the type of a comparison.
    return x * ZERO > ONE


@hook
def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Change the world at the end of a step.

    Per world, once per step, after all agents have eaten. The hook may write the arrays of the
    part, and the items and agents of the world.

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


class ItemRegion(Fields):
    """Rectangle with uniformly placed items.

    After an agent eats an item, the engine immediately places a new item in the same region.

    Attributes
    ----------
    kind : str
        Kind of the items, such as "food".
    x, y : (float, float)
        `x`: left and right edge. `y`: upper and lower edge. In units of length.
    count : int
        Number of items.
    energy : float
        Energy that an agent gains from an item.
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
    """Feature of the world, which adds items, walls or changes over time.

    Attributes
    ----------
    allows_births : bool
        True if agents are born during a lifetime.
    allows_deaths : bool
        True if the part calls `die`, so that the number of agents can change during a lifetime.
    """

    kind: ClassVar[str] = "world feature"
    allows_births: ClassVar[bool] = False
    allows_deaths: ClassVar[bool] = False

    def items(self) -> tuple[ItemRegion, ...]:
        """Return the regions of items that the feature adds to the food of the world."""
        return ()

    def map_shapes(self) -> tuple[dict[str, Any], ...]:
        """Return the shapes of the feature on drawn maps.

        Returns
        -------
        tuple of dict
            Shapes, such as {"shape": "rectangle", "x": (10, 20), "y": (0, 5), "color": "gray",
            "label": "wall"}. `x` has the left and right edge, `y` the upper and lower edge.
        """
        return ()

    init_world: ClassVar[Any] = staticmethod(init_world.default)
    blocks_placement: ClassVar[Any] = staticmethod(blocks_placement.default)
    blocks_sight: ClassVar[Any] = staticmethod(blocks_sight.default)
    blocks_movement: ClassVar[Any] = staticmethod(blocks_movement.default)
    end_step: ClassVar[Any] = staticmethod(end_step.default)
