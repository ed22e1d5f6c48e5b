"""Hooks that differ between populations: deaths, diets, and several species in a world.

`State.population` has the type of one of these classes, for which the step is compiled:

- `FixedPopulation`: one species without births and deaths during life. All agents eat all items.
  The hooks add no code.
- `MortalPopulation` (`mortality.py`): agents that can die, or that do not eat all items.
- `ReproducingPopulation` (`mortality.py`): agents that can be born during the lifetimes of others.
- `SpeciesPopulation` (`species_step.py`): one of several species that share a world.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

from baldwinlab.engine.phases import Array, hook, make_part_type
from baldwinlab.engine.simd import INFINITY, Lane
from baldwinlab.models.miniworld.map import move_agents
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.births_and_deaths import bear_agent, remove_agent
from baldwinlab.parts.learning_rules import learn


@hook
def agent_number(part: Any, agent: int) -> int:
    """Return the index of an agent among the agents of all species of the world."""
    return agent


@hook
def newborn_number(part: Any, model: MiniWorldModel, birth: int) -> int:
    """Return the unique number of a newborn agent, which selects the random numbers of this agent.

    `birth` is the number of earlier births of the species in this world during the lifetime.
    """
    return model.agents + birth


@hook
def start_life(part: Any, state: State, lane: int) -> None:
    """At birth: let the agent be alive, with the age 0."""


@hook
def is_alive(part: Any, state: State, lane: int) -> bool:
    """Return whether an agent is alive."""
    return True


@hook
def eats_region(part: Any, region: int) -> bool:
    """Return whether the agents eat the items of a region."""
    return True


@hook
def exclude_dead(part: Any, state: State, lane: Lane) -> None:
    """Before sensing: set `near` of dead agents to 0, so that dead agents do not sense."""


@hook
def move_living(part: Any, model: MiniWorldModel, state: State, lane: Lane) -> None:
    """Move the agents that are alive."""
    move_agents(state.features, model, state, lane)


@hook
def has_learners(part: Any, model: MiniWorldModel, step: int) -> bool:
    """Return whether any agent can learn in a step."""
    return step < model.learning_steps


@hook
def learn_living(part: Any, model: MiniWorldModel, state: State, step: int, lane: Lane) -> None:
    """Let the agents that are alive learn."""
    learn(state.rule, model, state, step, lane)


@hook
def count_step(part: Any, state: State, lane: Lane) -> None:
    """In every step: count the steps of the agents that are alive."""


class SpeciesScan(NamedTuple):
    """An agent that senses other species, and the compiled part of the sense.

    `sense.target_number` is the index of a species, or -1 for all other species.
    `sense.distances` [3, lane]: distance of the nearest visible agent in the left, front and right
    sector. The distance is infinite without such an agent.
    """

    sense: Any
    world: int
    agent: int


@hook
def see_species(part: Any, model: MiniWorldModel, state: State, scan: SpeciesScan) -> None:
    """Set `scan.sense.distances` of an agent. By default, no species is visible."""
    for sector in range(3):
        scan.sense.distances[sector, scan.world * model.agents + scan.agent] = INFINITY


class FixedPopulation:
    """One species without births and deaths during life. All agents eat all items."""

    arrays: ClassVar[Mapping[str, Array]] = {}
    values: ClassVar[Sequence[str]] = ()
    Compiled: ClassVar[Any]
    agent_number = staticmethod(agent_number.default)
    newborn_number = staticmethod(newborn_number.default)
    start_life = staticmethod(start_life.default)
    is_alive = staticmethod(is_alive.default)
    eats_region = staticmethod(eats_region.default)
    exclude_dead = staticmethod(exclude_dead.default)
    move_living = staticmethod(move_living.default)
    has_learners = staticmethod(has_learners.default)
    learn_living = staticmethod(learn_living.default)
    count_step = staticmethod(count_step.default)
    see_species = staticmethod(see_species.default)
    remove_agent = staticmethod(remove_agent.default)
    bear_agent = staticmethod(bear_agent.default)


make_part_type(FixedPopulation, [])
