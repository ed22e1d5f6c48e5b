"""Appearance of the world in a trace, including traces of earlier versions."""

from __future__ import annotations

import json
from typing import Any

from baldwinlab.core.deferred import xr

APPEARANCE_ATTRIBUTE = "appearance"
# Names of attributes and keys in traces of earlier versions.
EARLIER_APPEARANCE_ATTRIBUTE = "look"
RENAMED_KEYS = {"colour": "color", "real": "is_continuous", "lessons": "has_teachers"}


def has_appearance(trace: xr.Dataset) -> bool:
    """Return whether a dataset describes the appearance of a world."""
    return APPEARANCE_ATTRIBUTE in trace.attrs or EARLIER_APPEARANCE_ATTRIBUTE in trace.attrs


def read_appearance(trace: xr.Dataset) -> dict[str, Any]:
    """Return the appearance of the world of a trace, in the form of `Appearance.to_dict`.

    Raise KeyError if the trace does not describe the appearance.
    """
    if APPEARANCE_ATTRIBUTE in trace.attrs:
        return dict(json.loads(trace.attrs[APPEARANCE_ATTRIBUTE]))
    return dict(json.loads(trace.attrs[EARLIER_APPEARANCE_ATTRIBUTE], object_hook=_rename_keys))


def _rename_keys(settings: dict[str, Any]) -> dict[str, Any]:
    return {RENAMED_KEYS.get(key, key): value for key, value in settings.items()}
