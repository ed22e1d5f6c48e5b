"""Exports of studies with time series within a lifetime."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from baldwinlab.api.export.table import Table
from baldwinlab.api.export.zarr import write_zarr
from baldwinlab.core.errors import RefusedError
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study, shorten_preset


def make_study(directory: Path, every: int) -> StudyStore:
    """Return a study of three conditions, one of them without time series."""
    conditions = [
        shorten_preset("evo/A").replace(name="hundreds", record={"every": 100}),
        shorten_preset("evo/A").replace(name="others", record={"every": every}),
        shorten_preset("evo/A"),
    ]
    return make_small_study(directory, conditions, runs=2)


def test_a_zarr_store_has_the_time_series_of_the_study(tmp_path: Path) -> None:
    study = make_study(tmp_path / "study", every=100)
    write_zarr(study, tmp_path / "study.zarr")
    exported = xr.open_zarr(tmp_path / "study.zarr", consolidated=False)
    data = open_runs(study.directory)
    assert exported["window"].values.tolist() == [0, 100, 200]
    for name in ("energy_gained", "births", "agents_alive"):
        np.testing.assert_array_equal(exported[name], data[name].transpose(*exported[name].dims))
    assert np.isnan(exported["energy_gained"].sel(condition="evo/A")).all()


def test_a_zarr_store_refuses_conditions_with_different_windows(tmp_path: Path) -> None:
    study = make_study(tmp_path / "study", every=150)
    with pytest.raises(RefusedError, match=r"record.every and lifetime.steps must be equal"):
        write_zarr(study, tmp_path / "study.zarr")


def test_a_table_of_agents_has_no_time_series(tmp_path: Path) -> None:
    table = Table(make_study(tmp_path / "study", every=100))
    names = {column.name for column in table.columns}
    assert "food_eaten" in names
    assert "energy_gained" not in names
