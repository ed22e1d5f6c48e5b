"""The tidy table of a study, against its records, in all libraries; and the table of outcomes."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pyarrow.parquet as pq
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab import Study
from baldwinlab.analysis.statistics import fitness
from baldwinlab.api.export import table as table_export
from baldwinlab.api.export.table import StudyTable
from tests.small_studies import make_small_study, shorten_preset

KEY = ["condition", "run", "generation", "agent"]


@pytest.fixture(autouse=True)
def _warned_of_is_wrong() -> None:
    warnings.simplefilter("error")


def by_key(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.astype({"condition": str}).set_index(KEY)


def require_equal_values(frame: pd.DataFrame, expected: pd.DataFrame) -> None:
    without_types = dict.fromkeys(("check_dtype", "check_index_type", "check_categorical"), False)
    pd.testing.assert_frame_equal(by_key(frame), by_key(expected), **without_types)


def require_equal_records(frame: pd.DataFrame, study: Study) -> None:
    """Require that the table has the values of all records and no other rows."""
    rows = 0
    for condition in study.conditions:
        for run in study.runs(condition):
            record = study._store.read(condition, run)
            is_of_run = (frame["condition"] == condition) & (frame["run"] == run)
            rows_of_run = frame[is_of_run].reset_index(drop=True)
            shape = record["energy"].shape
            assert len(rows_of_run) == record["energy"].size
            for name in ("food_eaten", "energy", "ones", "used"):
                if name in record:
                    np.testing.assert_array_equal(
                        rows_of_run[name].to_numpy().reshape(shape), record[name].values
                    )
                else:
                    assert rows_of_run[name].isna().all()
            for number, parent in enumerate(("fitter", "other")):
                np.testing.assert_array_equal(
                    rows_of_run[f"parents_{parent}"].to_numpy().reshape(shape),
                    record.parents[..., number],
                )
            rows += len(rows_of_run)
    assert len(frame) == rows
    assert not by_key(frame).index.has_duplicates


def test_a_table_of_pandas_has_the_records_units_and_labels(mixed: Study) -> None:
    frame = mixed.to_pandas()
    require_equal_records(frame, mixed)
    assert frame["learner"].unique().tolist() == ["evo", "guessing"]
    units = frame.attrs["units"]
    assert (units["food_eaten"], units["used"]) == ("items", "trials")
    assert frame.attrs["long_name"]["ones"] == "share of alleles that are 1, the correct allele"
    assert frame.attrs["seed"] == 5
    # The models have different units of energy.
    assert "energy" not in frame.attrs["units"]


def test_pandas_and_polars_read_parquet_with_the_same_values(
    mixed: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A row group has two runs.
    monkeypatch.setattr(table_export, "MIN_ROWS", 70)
    path = tmp_path / "study.parquet"
    mixed.export(path)
    assert pq.ParquetFile(path).num_row_groups == 2
    read = pd.read_parquet(path)
    table = mixed.to_pandas()
    assert read.attrs == table.attrs
    require_equal_values(read, table)
    by_polars = pl.read_parquet(path)
    assert by_polars.columns == table.columns.tolist()
    assert by_polars["food_eaten"].dtype == pl.Int32
    for name in by_polars.columns:
        values = table[name].astype(object).where(table[name].notna(), None)
        assert by_polars[name].to_list() == values.tolist(), name
    field = pq.read_schema(path).field("food_eaten")
    assert field.metadata == {b"units": b"items", b"long_name": b"items eaten in life"}


def test_csv_is_read_by_pandas_and_by_a_reader_of_its_metadata(
    mixed: Study, tmp_path: Path
) -> None:
    path = tmp_path / "study.csv"
    mixed.export(path)
    table = mixed.to_pandas()
    missing = {name: "" for name in table.columns if name != "map"}
    read = pd.read_csv(path, keep_default_na=False, na_values=missing)
    require_equal_values(read, table)

    csvw = pytest.importorskip("csvw")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of its own libraries
        described = csvw.CSVW(str(tmp_path / "study.csv-metadata.json"), validate=True)
        (csvw_table,) = described.tables
        rows = list(csvw_table)
    assert described.is_valid
    assert [row["energy"] for row in rows] == table["energy"].tolist()
    assert [row["food_eaten"] for row in rows[-3:]] == [None] * 3
    assert isinstance(rows[0]["food_eaten"], int)
    metadata = json.loads(path.with_name("study.csv-metadata.json").read_text())
    columns = {column["name"]: column for column in metadata["tableSchema"]["columns"]}
    assert columns["food_eaten"]["schema:unitText"] == "items"


def test_in_a_sweep_the_fields_that_were_swept_are_columns(tmp_path: Path) -> None:
    short = {"lifetime.steps": 30, "evolution.generations": 2}
    fields = {"learning.rate": [0.0, 0.5], "evolution.selection": ["roulette", "truncation"]}
    given = {"experiment": "evo+self-taught/A", "runs": 1, "set": short, "fields": fields}
    study = bl.sweep(given, out=tmp_path / "swept")
    frame = study.to_pandas()
    by_point = frame.groupby([*fields], observed=True)["run"]
    assert by_point.count().tolist() == [40] * 4
    study.export(tmp_path / "swept.csv")
    study.export(tmp_path / "swept.parquet")
    rates = frame["learning.rate"].tolist()
    assert pd.read_csv(tmp_path / "swept.csv")["learning.rate"].tolist() == rates
    read = pd.read_parquet(tmp_path / "swept.parquet")
    assert read["learning.rate"].unique().tolist() == [0.0, 0.5]


def test_a_table_of_agents_has_no_time_series(tmp_path: Path) -> None:
    experiment = shorten_preset("evo/A").replace(record={"every": 100})
    table = StudyTable(make_small_study(tmp_path / "study", [experiment], runs=1))
    assert "food_eaten" in table.names
    assert "energy_gained" not in table.names


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
