"""Senses of other agents: a base class, neighbors in three sectors, and agents of other species.

A sense uses the positions at the start of the step. With the sequential update, a sense uses the
positions at the start of the agent's turn.

The senses of other species have binary or real-valued inputs, and the sectors of the sense `food`.
These senses are our choice, without a source. In an experiment without species, all inputs are 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, hook, per_agent, per_world
from baldwinlab.engine.simd import INFINITY, ONE
from baldwinlab.models.miniworld.map import shortest_difference
from baldwinlab.models.miniworld.population import SpeciesScan, see_species
from baldwinlab.models.miniworld.senses.sight import (
    SECTORS,
    Sectors,
    is_within_sight,
    pack_sectors,
    test_sectors,
)
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.senses import Sense
from baldwinlab.parts.world_features import LineOfSight

N_SECTORS = len(SECTORS)


@hook
def record_agent(
    part: Any, model: MiniWorldModel, state: State, line: LineOfSight, lane: int
) -> None:
    """Update the arrays of the sense with another agent within sight.

    Per agent, for each visible agent, when the sense calls `record_agents`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
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
        Arrays that a step changes, and the compiled parts.
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

    # [world, (x, y), agent]: positions at the start of the step.
    arrays: ClassVar[Mapping[str, Array]] = {"positions": per_world(2, "agents")}

    record_agent: ClassVar[Any] = staticmethod(record_agent.default)

    @staticmethod
    def prepare_senses(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        """Copy the positions of all agents of a world, because the agents move in the step."""
        for agent in range(model.agents):
            for axis in range(2):
                part.positions[world, axis, agent] = state.positions[
                    axis, world * model.agents + agent
                ]


class Neighbours(AgentSense, name="neighbours"):
    """Three binary inputs: another agent in the left, front and right sector.

    The sense uses the positions at the start of the step. With the sequential update, it uses the
    positions at the start of the agent's turn.
    """

    inputs: ClassVar[tuple[str, ...]] = ("agent left", "agent in front", "agent right")
    sectors: ClassVar[Sectors] = SECTORS

    @staticmethod
    def sense(part: Any, model: Any, state: Any, world: int, agent: int) -> int:
        lane = world * model.agents + agent
        bits = 0
        x = state.positions[0, lane]
        y = state.positions[1, lane]
        heading = int(state.heading[0, lane])
        for neighbor in range(model.agents):
            if neighbor != agent:
                dx = shortest_difference(part.positions[world, 0, neighbor] - x, model.width)
                dy = shortest_difference(part.positions[world, 1, neighbor] - y, model.height)
                left, front, right = test_sectors(model, state, LineOfSight(x, y, dx, dy), heading)
                bits |= pack_sectors(left, front, right)
        return bits


class SpeciesSense(Sense):
    """Base of the senses of agents of other species."""

    target: str = Field(
        "",
        max_length=60,
        description='Name of the sensed species. "": all species but that of the agent.',
    )
    sectors: ClassVar[Sectors] = SECTORS
    # [sector, lane]: distance of the nearest visible agent, or infinity.
    arrays: ClassVar[Mapping[str, Array]] = {"distances": per_agent(N_SECTORS)}
    # -1: all other species. `SpeciesBatch` sets the index of the species `target` instead.
    derived: ClassVar[Mapping[str, Any]] = {"target_number": lambda part, experiment: -1}


class SpeciesInSight(SpeciesSense, name="species-in-sight"):
    """Three binary inputs: an agent of another species in the left, front and right sector.

    The field `target` names the species.
    """

    inputs: ClassVar[tuple[str, ...]] = ("species left", "species in front", "species right")

    @staticmethod
    def sense(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> int:
        see_species(state.population, model, state, SpeciesScan(part, world, agent))
        lane = world * model.agents + agent
        bits = 0
        for sector in range(N_SECTORS):
            if part.distances[sector, lane] < INFINITY:
                bits |= 1 << sector
        return bits


class SpeciesNearness(SpeciesSense, name="species-nearness"):
    """Three real-valued inputs: the nearest agent of another species in each sector.

    The sectors are left, front and right. An input is 1 - distance / `senses.visual_radius`, and 0
    without a visible agent. The field `target` names the species.
    """

    inputs: ClassVar[tuple[str, ...]] = (
        "nearness left",
        "nearness in front",
        "nearness right",
    )
    is_continuous: ClassVar[bool] = True

    @staticmethod
    def measure(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        see_species(state.population, model, state, SpeciesScan(part, world, agent))
        lane = world * model.agents + agent
        for sector in range(N_SECTORS):
            share = min(part.distances[sector, lane] / model.visual_radius, ONE)
            state.activations[part.first_input + sector, lane] = ONE - share
