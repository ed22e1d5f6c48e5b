"""Regions and kinds of the items of an experiment, and the energy that agents gain from items.

A learning rule with these lines can read `get(part.energy_gained, 0, lane)` in the hook `learn`:

    class Rewarded(SynapticRule, name="rewarded"):
        arrays = ENERGY_ARRAYS
        derived = {**SynapticRule.derived, **ENERGY_VALUES}
        init_agent = staticmethod(reset_energy)
        observe_others = staticmethod(update_energy)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from baldwinlab.core.object_cache import cache_per_object
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import ZERO
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.state import FOOD, MiniWorldModel, State
from baldwinlab.parts.world_features import ItemRegion

# A color of `baldwinlab.analysis.palette`.
FOOD_COLOR: Final = "green"


@cache_per_object
def item_regions(experiment: Experiment) -> tuple[ItemRegion, ...]:
    """Return all regions of items: first the food of the world, then the items of features.

    Parameters
    ----------
    experiment : Experiment
        The experiment, as a function of `derived` gets it.

    Returns
    -------
    tuple of ItemRegion
        Kind, edges, number and energy of the items. The index is the argument `region` of hooks.
    """
    food = tuple(
        ItemRegion(
            kind=FOOD,
            x=region.x,
            y=region.y,
            count=region.count,
            energy=region.energy,
            color=FOOD_COLOR,
        )
        for region in experiment.world.food
    )
    return food + tuple(
        region for feature in experiment.parts("world.features") for region in feature.items()
    )


def item_kinds(experiment: Experiment) -> tuple[str, ...]:
    """Return the kinds of items. Kind 0 is food, even if there is no food.

    Parameters
    ----------
    experiment : Experiment
        The experiment, as a function of `derived` gets it.

    Returns
    -------
    tuple of str
        Names of the kinds. The index is the value in `model.region_kind`.
    """
    return tuple(dict.fromkeys([FOOD, *(region.kind for region in item_regions(experiment))]))


def eaten_energies(experiment: Experiment) -> list[float]:
    """Return the energy of an eaten item of each region, then of an agent of each prey species.

    The order is that of the rows of `State.eaten_in_life`.
    """
    energies = [region.energy for region in item_regions(experiment)]
    prey_energies = [prey.energy for prey in experiment.eats.prey]
    # Without regions, `State.eaten_in_life` also has a row for items.
    return [*(energies or [0.0]), *prey_energies] if prey_energies else energies


def kind_number(kind: str) -> Callable[[Any, Experiment], int]:
    """Return a function for `derived` of a part, which returns the index of a kind of items.

    Parameters
    ----------
    kind : str
        Name of the kind, for example "food".

    Returns
    -------
    Callable
        Function of (part, experiment). It returns the index, or -1 if no item has the kind.
    """
    return lambda part, experiment: (
        item_kinds(experiment).index(kind) if kind in item_kinds(experiment) else -1
    )


ENERGY_VALUES: Final[Mapping[str, Any]] = {
    "energies": lambda part, experiment: np.array(eaten_energies(experiment), np.float32)
}
"""Derived values of a part that calls `energy_in_life`, `reset_energy` or `update_energy`."""
ENERGY_ARRAYS: Final[Mapping[str, Array]] = {
    "energy": per_agent(1),
    "energy_gained": per_agent(1),
}
"""Arrays of a part that calls `update_energy`: energy gained since birth, and in the last step."""


@compiled
def energy_in_life(part: Any, state: State, lane: int) -> np.float32:
    """Return the energy that an agent has gained since birth.

    A per-agent hook for SIMD blocks cannot call this function, because it reads integers.

    Parameters
    ----------
    part : NamedTuple
        Part with the derived values `ENERGY_VALUES`.
    state : State
        Arrays that a step changes, and the compiled parts.
    lane : int
        Column of the agent.

    Returns
    -------
    float32
        Sum of the energies of the eaten items and agents.
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
        Arrays that a step changes, and the compiled parts.
    world, agent : int
        Indices of the world and of the agent in it.
    """
    lane = world * model.agents + agent
    part.energy[0, lane] = ZERO
    part.energy_gained[0, lane] = ZERO


@compiled
def update_energy(part: Any, model: MiniWorldModel, state: State, world: int, step: int) -> None:
    """Update the energies of all agents, as the hook `observe_others` of a learning rule.

    Agents eat after they learn. So `part.energy_gained` is the energy of the items that an agent
    ate at the end of the previous step.

    Parameters
    ----------
    part : NamedTuple
        Part with the arrays `ENERGY_ARRAYS` and the derived values `ENERGY_VALUES`.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    world : int
        Index of the world.
    step : int
        Step of the lifetime, from 0.
    """
    for lane in range(world * model.agents, (world + 1) * model.agents):
        energy = energy_in_life(part, state, lane)
        part.energy_gained[0, lane] = energy - part.energy[0, lane]
        part.energy[0, lane] = energy
