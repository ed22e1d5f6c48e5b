"""Tests of competitions in the lab: the same numbers as in Python, within the lab's limits."""

from __future__ import annotations

from typing import Any

import pytest

import baldwinlab as bl
from tests.lab.client import CLIENT, LabServer


def compete(server: LabServer, **body: Any) -> dict[str, Any]:
    files = {"a": "generation-2.nc", "b": "generation-0.nc"}
    response = CLIENT.post(f"{server.address}/api/compete", json=files | body)
    result: dict[str, Any] = response.json()
    return result


def test_a_competition_has_the_numbers_of_python(freezer: LabServer) -> None:
    files = [freezer.root / f"generation-{generation}.nc" for generation in (2, 0)]
    expected = bl.compete(*files, lives=4, seed=3)
    result = compete(freezer, lives=4, seed=3)
    assert result["energy"] == [expected.energy_a, expected.energy_b]
    assert result["outcome"] == "items eaten"
    assert [result[name] for name in ("difference", "low", "high")] == [
        expected.difference,
        expected.low,
        expected.high,
    ]


def test_agents_compete_in_another_condition(freezer: LabServer) -> None:
    result = compete(freezer, lives=1, condition="evo+self-taught/B")
    assert result["condition"] == "evo+self-taught/B"
    # One life has no interval.
    assert result["low"] is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": "../2.nc"}, "outside"),
        ({"a": "none.nc"}, "there is no genome file"),
        ({"b": "small/study.toml"}, "there is no genome file"),
        ({"lives": 0}, "lives = 0 must be"),
        ({"lives": 201}, "at most 200"),
        ({"condition": "/etc/hostname"}, "must be a preset"),
        ({"condition": "evo/A"}, "do not fit evo/A"),
    ],
)
def test_an_invalid_competition_is_an_error(
    freezer: LabServer, change: dict[str, Any], message: str
) -> None:
    assert message in compete(freezer, **change)["error"]
