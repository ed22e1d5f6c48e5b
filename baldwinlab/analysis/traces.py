"""Appearance of the world in a trace."""

from __future__ import annotations

import json
from typing import Any

from baldwinlab.core.deferred import xr

APPEARANCE_ATTRIBUTE = "appearance"


def has_appearance(trace: xr.Dataset) -> bool:
    """Return whether a dataset describes the appearance of a world."""
    return APPEARANCE_ATTRIBUTE in trace.attrs


def read_appearance(trace: xr.Dataset) -> dict[str, Any]:
    """Return the appearance of the world of a trace, in the form of `Appearance.to_dict`.

    Raise KeyError if the trace does not describe the appearance.
    """
    return dict(json.loads(trace.attrs[APPEARANCE_ATTRIBUTE]))
