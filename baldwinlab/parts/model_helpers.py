"""Public helpers of `baldwinlab.parts` that the MiniWorld model defines.

The package of parts is below the models, so it imports no model. A helper is imported when a part
imports its name, as the registry imports a built-in part when an experiment chooses it.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any, Final

_MINIWORLD: Final = "baldwinlab.models.miniworld"
MODEL_HELPERS: Final[Mapping[str, str]] = {
    "AgentSense": f"{_MINIWORLD}.senses.other_agents",
    "ENERGY_ARRAYS": f"{_MINIWORLD}.regions",
    "ENERGY_VALUES": f"{_MINIWORLD}.regions",
    "ItemSense": f"{_MINIWORLD}.senses.real_valued",
    "energy_in_life": f"{_MINIWORLD}.regions",
    "is_on_map": f"{_MINIWORLD}.item_changes",
    "is_within_sight": f"{_MINIWORLD}.senses.sight",
    "item_kinds": f"{_MINIWORLD}.regions",
    "item_regions": f"{_MINIWORLD}.regions",
    "kind_number": f"{_MINIWORLD}.regions",
    "place_item_at": f"{_MINIWORLD}.item_changes",
    "place_item_randomly": f"{_MINIWORLD}.item_changes",
    "record_agents": f"{_MINIWORLD}.senses.other_agents",
    "record_items": f"{_MINIWORLD}.senses.real_valued",
    "remove_item": f"{_MINIWORLD}.item_changes",
    "reset_energy": f"{_MINIWORLD}.regions",
    "sense_items": f"{_MINIWORLD}.senses.sight",
    "shortest_difference": f"{_MINIWORLD}.map",
    "update_energy": f"{_MINIWORLD}.regions",
    "was_eaten": f"{_MINIWORLD}.item_changes",
    "wrap_position": f"{_MINIWORLD}.map",
}
"""Modules of the helpers, by the name of the helper."""


def load_model_helper(name: str) -> Any:
    """Return a helper of the MiniWorld model."""
    return getattr(import_module(MODEL_HELPERS[name]), name)
