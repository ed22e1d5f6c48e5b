"""Public helpers of `baldwinlab.parts` for hooks of the MiniWorld model.

The MiniWorld model defines most helpers. The package of parts is below the models and must not
import a model. So `baldwinlab.parts` imports a helper only when a part imports the helper by name.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any, Final

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.rng import philox, unit


@compiled
def draw_unit(state: Any, world: int, purpose: int, index: int, draw: int) -> np.float32:
    """Return a random number in [0, 1) from a lifetime, for a per-world hook.

    Equal arguments give the same number in every step of a generation of a run.

    Parameters
    ----------
    state : State
        Arrays of the step, with the seed, the run and the generation.
    world : int
        Index of the world.
    purpose : int
        Purpose of the number, from `purpose("my-part: name")`.
    index : int
        Index of the agent or item.
    draw : int
        Number of the draw, for example the step.

    Returns
    -------
    float32
        A multiple of 2**-24.
    """
    seed = state.keys[world, 0]
    run = state.keys[world, 1]
    return unit(philox(draw, index, state.generation[0], purpose, seed, run)[0])


_HELPERS_BY_MODULE: Final[Mapping[str, tuple[str, ...]]] = {
    "item_changes": (
        "is_on_map",
        "place_item_at",
        "place_item_randomly",
        "remove_item",
        "was_eaten",
    ),
    "map": ("shortest_difference", "wrap_position"),
    "regions": (
        "ENERGY_ARRAYS",
        "ENERGY_VALUES",
        "energy_in_life",
        "item_kinds",
        "item_regions",
        "kind_number",
        "reset_energy",
        "update_energy",
    ),
    "senses.other_agents": ("AgentSense", "record_agents"),
    "senses.real_valued": ("ItemSense", "record_items"),
    "senses.sight": ("is_within_sight", "sense_items"),
}
MODEL_HELPERS: Final[Mapping[str, str]] = {
    name: f"baldwinlab.models.miniworld.{module}"
    for module, names in _HELPERS_BY_MODULE.items()
    for name in names
}
"""Modules of the helpers, by the name of the helper."""


def load_model_helper(name: str) -> Any:
    """Return a helper of the MiniWorld model."""
    return getattr(import_module(MODEL_HELPERS[name]), name)
