"""A study as a Zarr store, read with xarray."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any
from weakref import ref

import numpy as np
import pytest
import xarray as xr
import zarr

import baldwinlab as bl
from baldwinlab import Study
from baldwinlab.api.export import zarr as zarr_export
from baldwinlab.api.export.zarr import write_zarr
from baldwinlab.core.errors import RefusedError
from baldwinlab.studies import recorded_arrays
from tests.small_studies import make_small_study, shorten_preset
from tests.studies.completion import fail_without_space


def test_a_zarr_store_has_the_data_units_and_labels_of_the_study(
    mixed: Study, tmp_path: Path
) -> None:
    with warnings.catch_warnings():
        # Zarr warns about data types that its specification does not have.
        warnings.simplefilter("error")
        mixed.export(tmp_path / "study.zarr")
    data = mixed.data()
    opened = xr.open_zarr(tmp_path / "study.zarr", consolidated=False).load()
    xr.testing.assert_equal(opened, data)
    for name in data.variables:
        assert {key: opened[name].attrs[key] for key in data[name].attrs} == data[name].attrs
    assert opened.food_eaten.attrs == {"units": "items", "long_name": "items eaten in life"}
    assert bl.load(opened.sel(condition="guessing")) == mixed.experiment("guessing")
    assert zarr.open_group(tmp_path / "study.zarr", mode="r").metadata.zarr_format == 3


@pytest.mark.parametrize(
    "rows", [1, *(pytest.param(rows, marks=pytest.mark.nightly) for rows in (150, 250))]
)
def test_a_store_with_many_chunks_has_the_data_of_the_sweep(
    tmp_path: Path, rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run has 40 rows, so a chunk has one run, three runs, or two points of three runs each."""
    monkeypatch.setattr(zarr_export, "MAX_CHUNK_ROWS", rows)
    short = {"lifetime.steps": 20, "evolution.generations": 2}
    fields = {"evolution.selection": ["roulette", "truncation"], "learning.rate": [0.5, 0.0, 0.1]}
    study = bl.sweep(
        {"experiment": "evo+self-taught/A", "runs": 3, "set": short, "fields": fields},
        out=tmp_path / "swept",
    )
    # Without a run, integers become floating-point numbers, because missing values are NaN.
    for name in ("complete", "gaps"):
        study.export(tmp_path / f"{name}.zarr")
        opened = xr.open_zarr(tmp_path / f"{name}.zarr", consolidated=False).load()
        data = study.data()
        xr.testing.assert_equal(opened, data)
        for variable in ("food_eaten", "energy", "parents"):
            assert opened[variable].dims == data[variable].dims
            assert opened[variable].dtype == data[variable].dtype
        assert (opened.attrs["design"], opened.attrs["fields"]) == ("grid", [*fields])
        (study.directory / "runs" / study.conditions[4] / "0001.nc").unlink(missing_ok=True)


@pytest.mark.parametrize("stored_bytes", [0, 2**30], ids=["by chunk", "by variable"])
def test_a_store_is_written_from_one_variable_and_one_chunk_at_a_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stored_bytes: int
) -> None:
    study = make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=9)
    values_of_run = 3 * 20
    read = recorded_arrays.RecordedArray._read
    references: list[ref[np.ndarray]] = []
    peak_values = 0

    def read_and_count(self: Any, indices: Any) -> np.ndarray:
        nonlocal peak_values
        values = read(self, indices)
        references.append(ref(values))
        stored = [array.size for reference in references if (array := reference()) is not None]
        peak_values = max(peak_values, sum(stored))
        return values

    monkeypatch.setattr(recorded_arrays.RecordedArray, "_read", read_and_count)
    monkeypatch.setattr(recorded_arrays, "MAX_WHOLE_BYTES", stored_bytes)
    monkeypatch.setattr(zarr_export, "MAX_CHUNK_ROWS", 1)
    bl.open_study(study.directory).export(tmp_path / "study.zarr")
    # The variable `parents` has two values per agent.
    limit = 2 * (9 if stored_bytes else 2) * values_of_run
    assert 0 < peak_values <= limit
    assert len(references) == (3 if stored_bytes else 27)


def test_an_incomplete_or_misplaced_export_leaves_no_files(
    mixed: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(RefusedError, match="is inside the study"):
        mixed.export(mixed.directory / "runs" / "study.zarr")
    monkeypatch.setattr(Path, "replace", lambda path, target: fail_without_space(0))
    with pytest.raises(OSError, match="no space is left in"):
        mixed.export(tmp_path / "study.zarr")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("every", [100, 150])
def test_a_zarr_store_has_the_time_series_of_the_study(tmp_path: Path, every: int) -> None:
    conditions = [
        shorten_preset("evo/A").replace(name="hundreds", record={"every": 100}),
        shorten_preset("evo/A").replace(name="others", record={"every": every}),
        shorten_preset("evo/A"),
    ]
    study = make_small_study(tmp_path / "study", conditions, runs=2)
    write_zarr(study, tmp_path / "study.zarr")
    exported = xr.open_zarr(tmp_path / "study.zarr", consolidated=False)
    data = bl.open_study(study.directory).data()
    assert exported["window"].values.tolist() == sorted({0, 100, 200, every})
    for name in ("energy_gained", "births", "agents_alive"):
        np.testing.assert_array_equal(exported[name], data[name].transpose(*exported[name].dims))
    assert np.isnan(exported["energy_gained"].sel(condition="evo/A")).all()
