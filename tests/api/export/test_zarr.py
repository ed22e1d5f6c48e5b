"""A study as Zarr, as a phylogeny and for ArviZ, read with the libraries of these formats."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any
from weakref import ref

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import zarr

import baldwinlab as bl
from baldwinlab import Study
from baldwinlab.analysis.statistics import fitness
from baldwinlab.api.export import files
from baldwinlab.api.export import zarr as zarr_export
from baldwinlab.core.errors import RefusedError
from baldwinlab.studies import records
from baldwinlab.studies import store as stored
from tests.api.export.validators import validate
from tests.commands import Command
from tests.small_studies import make_small_study, shorten_preset
from tests.studies.completion import fail_without_space


def test_a_zarr_store_has_the_data_units_and_labels_of_the_study(
    mixed: Study, tmp_path: Path
) -> None:
    with warnings.catch_warnings():
        # Zarr warns about data types that its specification does not have.
        warnings.simplefilter("error")
        mixed.to_zarr(tmp_path / "study.zarr")
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
        study.to_zarr(tmp_path / f"{name}.zarr")
        opened = xr.open_zarr(tmp_path / f"{name}.zarr", consolidated=False).load()
        data = study.data()
        xr.testing.assert_equal(opened, data)
        for variable in ("food_eaten", "energy", "parents"):
            assert opened[variable].dims == data[variable].dims
            assert opened[variable].dtype == data[variable].dtype
        assert (opened.attrs["design"], opened.attrs["fields"]) == ("grid", [*fields])
        (study.directory / "runs" / study.conditions[4] / "0001.nc").unlink(missing_ok=True)


@pytest.mark.parametrize("method", ["to_zarr", "to_parquet", "to_csv"])
def test_an_export_has_a_few_runs_in_memory_at_a_time(
    tmp_path: Path, method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = records.read_record_of_file
    references: list[ref[np.ndarray]] = []
    peak_count = 0

    def read_and_count(*arguments: Any) -> xr.Dataset:
        nonlocal peak_count
        record = read(*arguments)
        references.append(ref(record["energy"].values))
        peak_count = max(peak_count, sum(reference() is not None for reference in references))
        return record

    monkeypatch.setattr(records, "read_record_of_file", read_and_count)
    monkeypatch.setattr(stored, "read_record_of_file", read_and_count)
    monkeypatch.setattr(zarr_export, "MAX_CHUNK_ROWS", 1)
    monkeypatch.setattr(files, "MIN_ROW_GROUP_ROWS", 1)
    study = bl.open_study(
        make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=9).directory
    )
    getattr(study, method)(tmp_path / "exported")
    assert len(references) >= 9
    assert peak_count <= 3


def test_an_incomplete_or_misplaced_export_leaves_no_files(
    mixed: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(RefusedError, match="is inside the study"):
        mixed.to_zarr(mixed.directory / "runs" / "study.zarr")
    monkeypatch.setattr(Path, "replace", lambda path, target: fail_without_space(0))
    with pytest.raises(OSError, match="no space is left in"):
        mixed.to_zarr(tmp_path / "study.zarr")
    assert not list(tmp_path.iterdir())


def test_the_phylogeny_of_a_study_has_the_phylogenies_of_all_runs(
    mixed: Study, command: Command
) -> None:
    done = command("export", str(mixed.directory), "--format", "phylogeny", "--out", "all.csv")
    assert done.out == "all.csv: 152 agents\n"
    table = pd.read_csv("all.csv")
    assert (table["ancestor_list"] == "[none]").sum() == 20 + 20 + 8
    first_id = 0
    for (condition, run), rows in table.groupby(["condition", "run"], sort=False):
        mixed.to_phylogeny("single.csv", str(condition), int(str(run)))
        single = pd.read_csv("single.csv")
        assert (rows["id"].to_numpy() - first_id).tolist() == single["id"].tolist()
        assert parent_ids(rows, first_id) == parent_ids(single, 0)
        first_id += len(single)
    mixed.to_phylogeny("all.csv", "evo/A")
    assert pd.read_csv("all.csv")["run"].unique().tolist() == [0, 1]


def parent_ids(phylogeny: pd.DataFrame, first_id: int) -> list[list[int]]:
    """Return the parents of each agent, with numbers from `first_id`."""
    lists = phylogeny["ancestor_list"].str.findall(r"\d+")
    return [[int(parent) - first_id for parent in parents] for parents in lists]


@pytest.mark.nightly
def test_the_phylogeny_of_a_study_fulfills_the_alife_standard(mixed: Study, tmp_path: Path) -> None:
    path = tmp_path / "all.csv"
    mixed.to_phylogeny(path)
    result = validate("phylogeny", path)
    assert result["is_valid"]
    assert result["is_sexual"]
    assert len(result["roots"]) == 20 + 20 + 8


def test_a_run_without_a_condition_is_refused(mixed: Study, command: Command) -> None:
    phylogeny = ("--format", "phylogeny", "--run", "0", "--out", "x.csv")
    done = command("export", str(mixed.directory), *phylogeny)
    message = "--run 0 needs --condition, because every condition has a run 0; add --condition"
    assert (done.code, done.err) == (2, f"baldwinlab: {message}\n")


def test_arviz_has_the_outcome_of_each_run_as_observed_data(mixed: Study) -> None:
    convert_to_datatree = pytest.importorskip("arviz_base").convert_to_datatree
    summary = pytest.importorskip("arviz_stats.summary").summary
    tree = mixed.to_arviz(last=2)
    assert convert_to_datatree(tree) is tree
    observed = tree["observed_data"].to_dataset()
    for measure in ("best", "mean", "share"):
        np.testing.assert_array_equal(observed[measure], fitness.final(mixed.data(), measure, 2))
    assert observed["share"].attrs["units"] == "1"
    assert observed["mean"].attrs["long_name"] == "fitness of the average agent"

    evo = mixed.to_arviz().observed_data.to_dataset().sel(condition=["evo/A"])
    energy = np.stack([mixed._store.read("evo/A", run)["energy"].values for run in range(2)])
    options = {"group": "observed_data", "sample_dims": ["run"], "kind": "stats"}
    table = summary(xr.DataTree.from_dict({"observed_data": evo}), **options)
    # The summary rounds.
    for measure, values in (("mean", energy), ("best", energy.max(-1))):
        mean = float(table.loc[f"{measure}[evo/A]", "mean"])
        assert mean == pytest.approx(values.mean(), rel=0.01)
