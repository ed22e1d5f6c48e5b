"""Deaths and births of agents during a lifetime, for per-world hooks of world features.

A world has a fixed number of slots for agents. A death leaves the slot of the agent free, and a
birth needs a free slot. A feature that calls these functions declares `allows_deaths`, and
`allows_births` if it calls `bear`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook
from baldwinlab.engine.simd import ZERO

# x of a dead agent, in widths of the map: out of sight, even across the edges of the map.
DEAD_X = np.float32(-3)


@hook
def remove_agent(part: Any, model: Any, state: Any, world: int, agent: int) -> None:
    """Remove an agent from its world. `part`: the population of the species."""
    raise ValueError("die: the world feature must declare allows_deaths = True")


@hook
def bear_agent(part: Any, model: Any, state: Any, world: int, parents: tuple[int, int]) -> int:
    """Let two parents have a child. Return the slot of the child, or -1 if no slot is free.

    `part`: the population of the species. `parents`: indices in the world, the fitter one first.
    """
    raise ValueError("bear: the world feature must declare allows_births = True")


@compiled
def die(model: Any, state: Any, world: int, agent: int) -> None:
    """Let an agent die, in a per-world hook.

    A dead agent neither senses, moves, eats nor learns, and no agent senses it. The slot is free
    for a newborn. The weights stay unchanged. The call has no effect on a dead agent.

    Parameters
    ----------
    model : MiniWorldModel
        Constants of the lifetime.
    state : State
        Arrays that a step changes, and the compiled parts. `state.alive` [1, lane] is set to 0.
    world, agent : int
        Indices of the world and of the agent in it.
    """
    remove_agent(state.population, model, state, world, agent)


@compiled
def bear(model: Any, state: Any, world: int, first_parent: int, second_parent: int) -> int:
    """Let two agents have a child, in a per-world hook.

    The variation of the experiment creates the genome. The child has the first free slot of the
    world, a random birthplace in the start disc, and the age 0. Learning begins with the weights of
    the genome. Set `state.positions` after the call to choose another birthplace.

    Parameters
    ----------
    model : MiniWorldModel
        Constants of the lifetime.
    state : State
        Arrays that a step changes, and the compiled parts. `state.alive` [1, lane] of the child
        is set to 1.
    world : int
        Index of the world.
    first_parent, second_parent : int
        Indices of the parents in the world, the fitter one first. They can be equal.

    Returns
    -------
    int
        Index of the child in the world, or -1 if no slot is free.
    """
    parents = (first_parent, second_parent)
    return int(bear_agent(state.population, model, state, world, parents))


@compiled
def find_free_slot(model: Any, state: Any, world: int) -> int:
    """Return the first free slot of a world: the slot of a dead agent.

    Parameters
    ----------
    model : MiniWorldModel
        Constants of the lifetime.
    state : State
        Arrays that a step changes, and the compiled parts.
    world : int
        Index of the world.

    Returns
    -------
    int
        Index of the slot in the world, or -1 if all agents are alive.
    """
    slot = -1
    agent = 0
    while slot < 0 and agent < model.agents:
        if state.alive[0, world * model.agents + agent] == ZERO:
            slot = agent
        agent += 1
    return slot
