"""Births and deaths during life: a steady-state population without generations.

Eaten items give an agent energy.
An agent without energy, or at the maximum age, dies. A child replaces the agent in the same step.
The number of agents is therefore constant.
Each parent is drawn with a probability proportional to the remaining energy of the agent.
The variation of the experiment creates the genome of the child. The birthplace is random.
The child does not inherit learned weights, which are inherited between lifetimes only.
In the neutral control, a child is also born whenever an agent must die. The child replaces a random
agent, and the parents are random.

Sources:

- Births and deaths by energy: D. Ackley and M. Littman, "Interactions between learning and
  evolution", Artificial Life II (1991).
- Steady state with one child at a time: D. Whitley, "The GENITOR algorithm and selection pressure",
  ICGA 3 (1989).

The replacement of each dead agent by a child in the same step is our choice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.phases import Array
from baldwinlab.engine.rng import AGE, SELECTION
from baldwinlab.engine.simd import ZERO
from baldwinlab.evolution.proportional_selection import find_first_above, is_neutral_control
from baldwinlab.models.miniworld.birth import CHILD_ARRAYS, CHILD_VALUES, bear_child
from baldwinlab.models.miniworld.population import agent_number, is_alive, newborn_number
from baldwinlab.models.miniworld.regions import ENERGY_VALUES, energy_in_life
from baldwinlab.parts import Field, WorldFeature, compiled, per_world, philox, unit


@compiled
def _remaining_energy(part: Any, model: Any, state: Any, world: int, agent: int, step: int) -> Any:
    """Return the energy of an agent at the end of a step."""
    spent = part.cost_per_step * np.float32(step + 1 - part.birth_step[world, agent])
    return (
        part.initial_account[world, agent]
        - spent
        + energy_in_life(part, state, world * model.agents + agent)
    )


@compiled
def _reset_account(part: Any, model: Any, state: Any, world: int, agent: int, step: int) -> None:
    """Set the remaining energy of an agent to `initial_energy`, and `birth_step` to `step`."""
    part.birth_step[world, agent] = step
    part.initial_account[world, agent] = part.initial_energy - energy_in_life(
        part, state, world * model.agents + agent
    )


@compiled
def _is_dying(part: Any, model: Any, state: Any, world: int, agent: int, step: int) -> bool:
    """Return whether an agent is dead, has no energy left, or has reached the maximum age.

    An agent that another agent has eaten is already dead.
    """
    is_dead = not is_alive(state.population, state, world * model.agents + agent)
    is_too_old = step + 1 - part.birth_step[world, agent] >= part.max_age
    return bool(
        is_dead or is_too_old or _remaining_energy(part, model, state, world, agent, step) <= ZERO
    )


@compiled
def _fill_wheel(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Set `part.wheel` [world, agent] to cumulative energies, from which parents are drawn.

    All agents count equally in the neutral control, and if no agent has energy.
    """
    total = ZERO
    for agent in range(0 if part.is_neutral else model.agents):
        if is_alive(state.population, state, world * model.agents + agent):
            total += max(ZERO, _remaining_energy(part, model, state, world, agent, step))
        part.wheel[world, agent] = total
    has_equal_shares = total == ZERO
    for agent in range(model.agents if has_equal_shares else 0):
        part.wheel[world, agent] = np.float32(agent + 1)


@compiled
def _draw_agent(wheel: Any, word: Any) -> Any:
    """Draw an agent from cumulative energies. The random integer `word` determines the agent."""
    return find_first_above(wheel, unit(word) * wheel[wheel.size - 1])


@compiled
def _share(wheel: Any, agent: int) -> Any:
    """Return the energy of an agent (or 1, if all agents count equally)."""
    return wheel[agent] - (wheel[agent - 1] if agent > 0 else ZERO)


@compiled
def _replace_dying_agent(
    part: Any, model: Any, state: Any, world: int, agent: int, step: int
) -> None:
    """Replace a dying agent by a child.

    In the neutral control, the child replaces a random agent, and `agent` survives. An agent that
    is already dead, for example eaten, is replaced in any case.
    """
    # The number differs from the numbers of all earlier agents of the lifetime.
    number = newborn_number(state.population, model, part.births[world, 0])
    words = philox(
        0, number, state.generation[0], SELECTION, state.keys[world, 0], state.keys[world, 1]
    )
    wheel = part.wheel[world]
    is_survivor = part.is_neutral and is_alive(
        state.population, state, world * model.agents + agent
    )
    dead_agent = _draw_agent(wheel, words[2]) if is_survivor else agent
    first_parent = _draw_agent(wheel, words[0])
    second_parent = _draw_agent(wheel, words[1])
    # The parent with more energy is the fitter parent.
    if _share(wheel, second_parent) > _share(wheel, first_parent):
        first_parent, second_parent = second_parent, first_parent
    birth = part.births[world, 0]
    bear_child(part, model, state, world, dead_agent, birth, first_parent, second_parent)
    part.births[world, 0] += 1
    _reset_account(part, model, state, world, dead_agent, step + 1)
    # In the neutral control, `agent` survives with the energy and the age of a newborn.
    _reset_account(part, model, state, world, agent, step + 1)


class BirthsAndDeaths(WorldFeature, name="births-and-deaths"):
    """Deaths and births during life.

    An agent without energy, or at the maximum age, dies.
    A child of agents with energy replaces the dead agent in the same step.
    """

    initial_energy: float = Field(1.0, gt=0, le=1_000_000, description="Energy at birth.")
    cost_per_step: float = Field(
        0.001, ge=0, le=1_000_000, description="Cost of a step, in energy."
    )
    max_age: int = Field(
        2_000,
        ge=1,
        le=100_000_000,
        description="Maximum age, in steps.",
    )
    allows_births: ClassVar[bool] = True
    arrays: ClassVar[Mapping[str, Array]] = {
        # Step of the birth of an agent, or minus the age at the start of the lifetime.
        "birth_step": per_world("agents", dtype="int32"),
        # Energy at birth, minus the energy of the items eaten before birth.
        "initial_account": per_world("agents"),
        # Scratch: cumulative energies of the agents.
        "wheel": per_world("agents"),
        # Number of births of this lifetime.
        "births": per_world(1, dtype="int64"),
        **CHILD_ARRAYS,
    }
    derived: ClassVar[Mapping[str, Callable[[Any, Any], Any]]] = {
        **ENERGY_VALUES,
        "is_neutral": is_neutral_control,
        **CHILD_VALUES,
    }

    @staticmethod
    def init_world(part: Any, model: Any, state: Any, world: int) -> None:
        """Draw the ages and energies of the first agents.

        With equal ages, all agents would reach the maximum age in the same step.
        """
        part.births[world, 0] = 0
        for agent in range(model.agents):
            number = agent_number(state.population, agent)
            words = philox(
                0, number, state.generation[0], AGE, state.keys[world, 0], state.keys[world, 1]
            )
            age = int(unit(words[0]) * np.float32(part.max_age))
            part.birth_step[world, agent] = -age
            # The cost of the steps before the lifetime is added, because `_remaining_energy`
            # subtracts this cost.
            energy = unit(words[1]) * part.initial_energy
            part.initial_account[world, agent] = energy + part.cost_per_step * np.float32(age)

    @staticmethod
    def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        for agent in range(model.agents):
            if _is_dying(part, model, state, world, agent, step):
                # The previous death of the step has changed the energy of the replaced agent.
                _fill_wheel(part, model, state, world, step)
                _replace_dying_agent(part, model, state, world, agent, step)
