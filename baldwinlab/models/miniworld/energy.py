"""Energy that agents gain from items, for parts: in their lifetime, and in the last step.

A learning rule needs three lines, and then reads `get(part.energy_gained, 0, lane)` in `learn`:

    class Rewarded(SynapticRule, name="rewarded"):
        arrays = ENERGY_ARRAYS
        derived = {**SynapticRule.derived, **ENERGY_VALUES}
        init_agent = staticmethod(reset_energy)
        observe_others = staticmethod(update_energy)
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import ZERO
from baldwinlab.models.miniworld.regions import eaten_energies
from baldwinlab.models.miniworld.state import MiniWorldModel, State

ENERGY_VALUES: Final[Mapping[str, Any]] = {
    "energies": lambda part, experiment: np.array(eaten_energies(experiment), np.float32)
}
"""Derived values of a part that calls `energy_in_life`, `reset_energy` or `update_energy`."""
ENERGY_ARRAYS: Final[Mapping[str, Array]] = {
    "energy": per_agent(1),
    "energy_gained": per_agent(1),
}
"""Arrays of a part that calls `update_energy`: energy gained in life, and in the last step."""


@compiled
def energy_in_life(part: Any, state: State, lane: int) -> np.float32:
    """Return the energy that an agent has gained since its birth.

    It reads integers, so a per-agent hook for SIMD blocks cannot call it.

    Parameters
    ----------
    part : NamedTuple
        Part with the derived values `ENERGY_VALUES`.
    state : State
        Arrays of the step, and the other parts.
    lane : int
        Column of the agent.

    Returns
    -------
    float32
        Sum of the energies of the eaten items.
    """
    energy = ZERO
    for region in range(part.energies.size):
        energy += part.energies[region] * np.float32(
            state.eaten_in_life[region, lane] - state.eaten_before[region, lane]
        )
    return energy


@compiled
def reset_energy(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
    """Set the energies of a newborn agent to 0, as the hook `init_agent` of a learning rule.

    Parameters
    ----------
    part : NamedTuple
        Part with the arrays `ENERGY_ARRAYS`.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world, agent : int
        Indices of the world and of the agent in it.
    """
    lane = world * model.agents + agent
    part.energy[0, lane] = ZERO
    part.energy_gained[0, lane] = ZERO


@compiled
def update_energy(part: Any, model: MiniWorldModel, state: State, world: int, step: int) -> None:
    """Update the energies of all agents, as the hook `observe_others` of a learning rule.

    Agents eat after they learn. `part.energy_gained` is the energy of the items that an agent has
    eaten since the last call, at the end of the previous step.

    Parameters
    ----------
    part : NamedTuple
        Part with the arrays `ENERGY_ARRAYS` and the derived values `ENERGY_VALUES`.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world : int
        Index of the world.
    step : int
        Step of the lifetime, from 0.
    """
    for lane in range(world * model.agents, (world + 1) * model.agents):
        energy = energy_in_life(part, state, lane)
        part.energy_gained[0, lane] = energy - part.energy[0, lane]
        part.energy[0, lane] = energy
