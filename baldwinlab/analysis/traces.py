"""Read the appearance of the world from a trace, also from a trace of an earlier version."""

from __future__ import annotations

import json
from typing import Any

import xarray as xr

ATTRIBUTE = "appearance"
# Names in earlier traces.
EARLIER_ATTRIBUTE = "look"
RENAMED_KEYS = {"colour": "color", "real": "is_continuous", "lessons": "has_teachers"}


def has_appearance(trace: xr.Dataset) -> bool:
    """Return whether a dataset describes the appearance of a world."""
    return ATTRIBUTE in trace.attrs or EARLIER_ATTRIBUTE in trace.attrs


def read_appearance(trace: xr.Dataset) -> dict[str, Any]:
    """Return the appearance of the world of a trace, as `Appearance.to_dict`.

    Raise KeyError if the trace does not describe it.
    """
    if ATTRIBUTE in trace.attrs:
        return dict(json.loads(trace.attrs[ATTRIBUTE]))
    return dict(json.loads(trace.attrs[EARLIER_ATTRIBUTE], object_hook=_rename_keys))


def _rename_keys(table: dict[str, Any]) -> dict[str, Any]:
    return {RENAMED_KEYS.get(key, key): value for key, value in table.items()}
