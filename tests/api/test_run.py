"""A sweep in Python is the sweep of its file."""

from __future__ import annotations

from pathlib import Path

import pytest
import tomlkit
import xarray as xr

import baldwinlab as bl
from tests.small_studies import read_records

FOOD = {
    "experiment": "evo/A",
    "runs": 2,
    "set": {"lifetime": {"steps": 60}, "evolution.generations": 2},
    "fields": {"world.food.0.count": [0, 50]},
}


def test_a_dict_says_what_a_file_says(tmp_path: Path) -> None:
    (tmp_path / "food.toml").write_text(tomlkit.dumps(FOOD))
    by_file = bl.sweep(tmp_path / "food.toml", out=tmp_path / "by-file")
    by_dict = bl.sweep(FOOD, out=tmp_path / "by-dict", workers=1)
    assert read_records(by_file.directory) == read_records(by_dict.directory)
    xr.testing.assert_identical(by_dict.data(), by_file.data())
    assert by_dict.data().sizes["world.food.0.count"] == 2
    assert by_dict.report().exists()
    point = by_dict.data().sel({"world.food.0.count": 50})
    assert bl.load(point).world.food[0].count == 50
    assert bl.sweep({**FOOD, "runs": 3}, out=tmp_path / "by-dict").runs("point-0001") == [0, 1, 2]


def test_a_dict_that_cannot_be_a_sweep_is_refused(tmp_path: Path) -> None:
    with pytest.raises(bl.BaldwinLabError, match="out is missing"):
        bl.sweep(FOOD)
    with pytest.raises(bl.ExperimentError, match="sweep: fields: name at least one field to sweep"):
        bl.sweep({**FOOD, "fields": {}}, out=tmp_path / "study")
    with pytest.raises(bl.ExperimentError, match=r"sweep: point-0001: world.food.0.count = -5"):
        bl.sweep({**FOOD, "fields": {"world.food.0.count": [0, -5]}}, out=tmp_path / "study")
    assert not (tmp_path / "study").exists()
