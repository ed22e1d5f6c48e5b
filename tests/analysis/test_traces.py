"""The appearance of the world of a trace."""

from __future__ import annotations

import json

import xarray as xr

from baldwinlab.analysis.appearance import has_appearance, read_appearance


def test_the_appearance_is_an_attribute_of_a_trace() -> None:
    trace = xr.Dataset(attrs={"appearance": json.dumps({"inputs": ["left"]})})
    assert has_appearance(trace)
    assert read_appearance(trace) == {"inputs": ["left"]}
    assert not has_appearance(xr.Dataset())
