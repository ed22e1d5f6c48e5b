"""The comparison of a study is the same in the lab, the report, the table, Python and terminals."""

from __future__ import annotations

import html
import re
from pathlib import Path

import pandas as pd
import pytest

import baldwinlab as bl
from baldwinlab.analysis.results.table import HEADINGS, TEST_HEADINGS
from baldwinlab.analysis.statistics import fitness
from baldwinlab.api.publish.lab_results import compute_results, record_runs
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study

SHORT = {"evolution.generations": 3, "lifetime.steps": 200, "world.start.x": 400}


def run_conditions(out: Path) -> bl.Study:
    return bl.run(["evo/A", "evo+self-taught/A"], runs=5, out=out, set=SHORT)


def run_sweep(out: Path) -> bl.Study:
    fields = {"learning.rule": ["self-taught", "hebb"]}
    plan = {"experiment": "evo+self-taught/A", "runs": 5, "set": SHORT, "fields": fields}
    return bl.sweep(plan, out=out)


@pytest.mark.usefixtures("placeholder_figures")
@pytest.mark.parametrize("make_study", [run_conditions, run_sweep])
def test_all_outputs_have_the_same_rows_columns_and_sentences(
    make_study: object,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert callable(make_study)
    study: bl.Study = make_study(tmp_path / "it")
    monkeypatch.setenv("COLUMNS", "200")
    capsys.readouterr()
    page = html.unescape(study.report().read_text("utf-8"))
    terminal = capsys.readouterr().out
    comparison = compute_results(StudyStore(study.directory))["comparison"]
    in_python = study.compare()
    in_table = pd.read_csv(study.directory / "statistics.csv")
    assert len(comparison["rows"]) == len(in_python) == len(in_table) == 2
    numbers = pd.DataFrame(comparison["rows"])[in_table.columns.intersection(in_python.columns)]
    for name in numbers:
        assert numbers[name].tolist() == in_python[name].tolist() == in_table[name].tolist()
    assert comparison["headings"] == dict(HEADINGS)
    assert comparison["test_headings"] == dict(TEST_HEADINGS)
    (summary,) = comparison["summary"]
    assert "items" in summary
    for sentence in (summary, comparison["statistic"], comparison["pairing"]):
        assert sentence in page and sentence in re.sub(r"\s+", " ", terminal)
    cells_of_page = [
        re.sub(r"<[^>]+>", "", cell).strip() for cell in re.findall(r"<td[^>]*>(.*?)</td>", page)
    ]
    for row in comparison["rows"]:
        for key in {**HEADINGS, **TEST_HEADINGS}:
            text = row["cells"][key]
            assert text in terminal or key not in HEADINGS
            assert key == "condition" or any(text in cell for cell in cells_of_page), key
    for key, heading in {**HEADINGS, **TEST_HEADINGS}.items():
        cell = rf'<th scope="col"[^>]*>{re.escape(heading)}</th>'
        assert re.search(cell, page) and (heading in terminal or key not in HEADINGS)


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


def test_a_run_that_was_stored_after_the_data_were_read_has_no_row(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "it", runs=2)
    data = open_sample(study, list(study.experiments)).isel(run=[0])
    assert {row["run"] for row in record_runs(study, data)["rows"]} == {0}


def test_numbers_start_with_the_largest_and_texts_with_the_first(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "it", runs=1)
    table = record_runs(study, open_sample(study, list(study.experiments)))
    orders = {(column["format"], column["order"]) for column in table["columns"]}
    assert orders == {("text", "ascending"), ("number", "descending")}
    titles = {column["key"]: column["title"] for column in table["columns"]}
    assert titles["mean"] == "Average agent, items eaten"
    assert table["sorted"] in titles
    assert table["note"] == "averaged over the last 10 generations"
