"""The table of all runs has the columns, the order and the values that the page draws."""

from __future__ import annotations

from pathlib import Path

from baldwinlab.analysis.statistics import fitness
from baldwinlab.api.publish.run_table import record_runs
from baldwinlab.studies.open import open_sample
from tests.small_studies import make_small_study


def test_each_run_has_a_row_with_a_value_for_each_column(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "it", runs=2)
    data = open_sample(study, list(study.experiments))
    table = record_runs(study, data)
    keys = [column["key"] for column in table["columns"]]
    assert keys[:2] == ["condition", "run"]
    assert set(fitness.MEASURES) <= set(keys)
    assert all(list(row) == keys for row in table["rows"])
    runs = [(row["condition"], row["run"]) for row in table["rows"]]
    assert runs == [(name, run) for name in study.experiments for run in study.runs(name)]
    best = fitness.final(data, "best")
    for row in table["rows"]:
        assert row["best"] == best.sel(condition=row["condition"], run=row["run"])


def test_numbers_start_with_the_largest_and_texts_with_the_first(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "it", runs=1)
    table = record_runs(study, open_sample(study, list(study.experiments)))
    orders = {(column["format"], column["order"]) for column in table["columns"]}
    assert orders == {("text", "ascending"), ("number", "descending")}
    titles = {column["key"]: column["title"] for column in table["columns"]}
    assert titles["mean"] == "Average agent, items eaten"
    assert table["sorted"] in titles
    assert table["note"] == "averaged over the last 10 generations"
