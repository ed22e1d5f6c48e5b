"""Scan of the other agents within the visual radius of an agent, for senses.

A sense uses the positions at the start of the step. With the sequential update, it uses the
positions at the start of the agent's turn.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, hook, per_world
from baldwinlab.models.miniworld.map import shortest_difference
from baldwinlab.models.miniworld.senses.sight import is_within_sight
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.senses import Sense
from baldwinlab.parts.world_features import LineOfSight


@hook
def record_agent(
    part: Any, model: MiniWorldModel, state: State, line: LineOfSight, lane: int
) -> None:
    """Use another agent within sight.

    Per agent, for each visible agent, when the sense calls `record_agents`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    line : LineOfSight
        The line from the agent to the other agent.
    lane : int
        Column of the agent that senses.
    """


@compiled
def record_agents(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
    """Call `record_agent` for each other agent within `model.visual_radius` that is visible.

    Parameters
    ----------
    part : NamedTuple
        The first argument of a hook of an `AgentSense`.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world, agent : int
        Indices of the world and of the agent in it.
    """
    lane = world * model.agents + agent
    x = state.positions[0, lane]
    y = state.positions[1, lane]
    for neighbor in range(model.agents):
        if neighbor != agent:
            dx = shortest_difference(part.positions[world, 0, neighbor] - x, model.width)
            dy = shortest_difference(part.positions[world, 1, neighbor] - y, model.height)
            line = LineOfSight(x, y, dx, dy)
            if is_within_sight(model, state, line):
                record_agent(part, model, state, line, lane)


class AgentSense(Sense):
    """Base of the senses that read other agents, with `record_agents` and `record_agent`."""

    # x and y of all agents of a world.
    arrays: ClassVar[Mapping[str, Array]] = {"positions": per_world(2, "agents")}

    record_agent: ClassVar[Any] = staticmethod(record_agent.default)

    @staticmethod
    def prepare_senses(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        """Copy the positions of all agents of a world."""
        for agent in range(model.agents):
            for axis in range(2):
                part.positions[world, axis, agent] = state.positions[
                    axis, world * model.agents + agent
                ]
