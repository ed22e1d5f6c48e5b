"""The appearance of the world of a trace."""

from __future__ import annotations

import json

import xarray as xr

from baldwinlab.analysis.traces import has_appearance, read_appearance

EARLIER = {
    "inputs": ["left"],
    "real": [False],
    "item_kinds": [{"name": "food", "colour": "green", "number": 50}],
    "lessons": True,
}


def test_an_earlier_trace_has_the_keys_of_today() -> None:
    trace = xr.Dataset(attrs={"look": json.dumps(EARLIER)})
    assert has_appearance(trace)
    assert read_appearance(trace) == {
        "inputs": ["left"],
        "is_continuous": [False],
        "item_kinds": [{"name": "food", "color": "green", "number": 50}],
        "has_teachers": True,
    }


def test_a_dataset_without_an_appearance_has_none() -> None:
    assert not has_appearance(xr.Dataset())
