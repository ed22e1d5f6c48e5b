"""The tidy table of a study, against its records: in pandas, in polars, as Parquet and as CSV."""

from __future__ import annotations

import json
import re
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pyarrow.parquet as pq
import pytest

import baldwinlab as bl
from baldwinlab import Study, StudyError
from baldwinlab.api.export import files
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import installation_command
from tests.commands import Command
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


def test_a_table_of_polars_has_the_values_of_pandas_and_null_for_missing_values(
    mixed: Study,
) -> None:
    frame = mixed.to_polars()
    expected = mixed.to_pandas()
    assert frame.columns == expected.columns.tolist()
    assert frame["food_eaten"].dtype == pl.Int32
    assert frame["food_eaten"].null_count() == expected["food_eaten"].isna().sum()
    for name in frame.columns:
        dtype = pl.Float64 if frame[name].dtype.is_numeric() else pl.String
        column = expected[name].astype(object).where(expected[name].notna(), None)
        assert frame[name].cast(dtype).to_list() == column.tolist(), name


def test_pandas_and_polars_read_parquet_with_the_same_values(
    mixed: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A row group has two runs.
    monkeypatch.setattr(files, "MIN_ROW_GROUP_ROWS", 70)
    path = tmp_path / "study.parquet"
    mixed.to_parquet(path)
    assert pq.ParquetFile(path).num_row_groups == 2
    read = pd.read_parquet(path)
    table = mixed.to_pandas()
    assert read.attrs == table.attrs
    require_equal_values(read, table)
    by_polars = pl.read_parquet(path).with_columns(pl.col(pl.Categorical).cast(pl.String))
    assert by_polars.equals(mixed.to_polars().with_columns(pl.col(pl.Enum).cast(pl.String)))
    field = pq.read_schema(path).field("food_eaten")
    assert field.metadata == {b"units": b"items", b"long_name": b"items eaten in life"}


def test_csv_is_read_by_pandas_and_by_a_reader_of_its_metadata(
    mixed: Study, tmp_path: Path
) -> None:
    path = tmp_path / "study.csv"
    mixed.to_csv(path)
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
    study.to_csv(tmp_path / "swept.csv")
    study.to_parquet(tmp_path / "swept.parquet")
    rates = study.to_polars()["learning.rate"].to_list()
    assert pd.read_csv(tmp_path / "swept.csv")["learning.rate"].tolist() == rates
    read = pd.read_parquet(tmp_path / "swept.parquet")
    assert read["learning.rate"].unique().tolist() == [0.0, 0.5]


EXPORTS: list[Callable[[Study, Path], object]] = [
    lambda study, path: study.to_pandas(),
    lambda study, path: study.to_polars(),
    lambda study, path: study.to_arviz(),
    lambda study, path: study.to_parquet(path / "x.parquet"),
    lambda study, path: study.to_csv(path / "x.csv"),
    lambda study, path: study.to_zarr(path / "x.zarr"),
    lambda study, path: study.to_phylogeny(path / "x.csv"),
    lambda study, path: study.to_ro_crate(),
]


def test_a_study_without_a_run_and_a_damaged_run_are_named_and_nothing_is_left(
    tmp_path: Path,
) -> None:
    study = bl.open_study(
        make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=2).directory
    )
    out = tmp_path / "out"
    out.mkdir()
    record = study.directory / "runs" / "evo" / "A" / "0001.nc"
    record.write_bytes(record.read_bytes()[:-1] + b"?")
    for export in EXPORTS:
        with pytest.raises(StudyError, match=r"0001\.nc is damaged"):
            export(study, out)
    record.unlink()
    record.with_name("0000.nc").unlink()
    for export in EXPORTS:
        with pytest.raises(StudyError, match="holds no finished run yet"):
            export(study, out)
    assert not list(out.iterdir())


@pytest.mark.parametrize(("library", "number"), [("polars", 1), ("pyarrow", 3), ("zarr", 5)])
def test_without_a_library_the_error_has_the_command_that_installs_it(
    mixed: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: str, number: int
) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == library]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(RefusedError, match=re.escape(installation_command("exchange"))):
        EXPORTS[number](mixed, tmp_path)
    assert not list(tmp_path.iterdir())


def test_export_chooses_by_the_ending_and_writes_over_its_own_alone(
    mixed: Study, command: Command, tmp_path: Path
) -> None:
    source = str(mixed.directory)
    for ending in ("csv", "parquet"):
        for _ in range(2):  # its own may be written over
            done = command("export", source, "--out", f"mine.{ending}")
            assert (done.code, done.out) == (0, f"mine.{ending}: 3 runs\n"), done.err
        (tmp_path / f"theirs.{ending}").write_text("condition,years of work\n")
        refused = command("export", source, "--out", f"theirs.{ending}")
        assert refused.code == 2 and "exists and was not written by this command" in refused.err
        assert command("export", source, "--out", f"theirs.{ending}", "--force").code == 0
    assert pd.read_parquet("theirs.parquet").shape == (152, 15)
    assert command("export", source, "--out", "mine.zarr").code == 0
    refused = command("export", source, "--out", "mine.zarr", "--force")
    assert refused.code == 2 and "exists. Choose another path or remove it." in refused.err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["--out", "x.xlsx"],
            "--out x.xlsx must end in .html for a page, .trees for a tree sequence, .onnx for a "
            "network, or in .zarr, .parquet or .csv for the results of a study; or give --format",
        ),
        (["--out", "x.csv", "--seed", "3"], "--seed applies to --format page, not csv"),
        (
            [],
            "--out is missing: give a file that ends in .csv, .parquet, .zarr, .trees, .onnx or "
            ".html; only --format ro-crate needs no file",
        ),
        (["--format", "csv"], "--out is missing: --format csv needs the name of a file"),
        (
            ["--format", "ro-crate", "--out", "x.json"],
            "--out applies to --format csv or parquet or zarr or phylogeny or tskit or onnx or "
            "page or explorable or lesson, not ro-crate",
        ),
        (
            ["--format", "csv", "--out", "x.txt"],
            "--out x.txt must end in .csv, as --format csv needs",
        ),
        *(
            (
                ["--out", path],
                f"--out {path}: the folder no does not exist. Create it or choose another path.",
            )
            for path in ("no/x.zarr", "no/x.csv")
        ),
    ],
)
def test_what_cannot_be_exported_is_refused_in_a_sentence(
    mixed: Study, command: Command, words: list[str], sentence: str
) -> None:
    done = command("export", str(mixed.directory), *words)
    assert (done.code, done.err) == (2, f"baldwinlab: {sentence}\n")


def test_a_preset_has_no_results(command: Command) -> None:
    done = command("export", "evo/A", "--out", "x.csv")
    assert (done.code, done.err) == (2, "baldwinlab: evo/A holds no study: it has no study.toml\n")
