"""The report of a sweep, and the comparison of its points."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import baldwinlab as bl
from baldwinlab.api.publish.lab_results import compute_results
from baldwinlab.api.publish.results_cache import load_cached_results
from baldwinlab.api.publish.sweep_comparison import are_compared, describe_too_few_runs
from baldwinlab.studies.record_files import RecordFile
from baldwinlab.studies.recorded_arrays import FileContent, open_file
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import validate_sweep

PLAN = {
    "experiment": "evo/A",
    "runs": 4,
    "set": {"evolution.generations": 2, "lifetime.steps": 60, "world.start.x": 400},
    "fields": {"world.food.0.count": [50, 5]},
}


def test_a_report_verifies_each_file_once_and_stores_the_results_of_all_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep = bl.sweep(PLAN | {"runs": 1}, out=tmp_path / "food", workers=1)
    verified = Counter[str]()

    def count_file(file: RecordFile, *arguments: Any) -> FileContent:
        verified[file.path.parent.name] += 1
        return open_file(file, *arguments)

    monkeypatch.setattr("baldwinlab.studies.lazy_runs.open_file", count_file)
    sweep.report()
    assert verified == {"point-0000": 1, "point-0001": 1}
    store = StudyStore(sweep.directory)
    assert load_cached_results(store) == compute_results(store)


def test_points_are_compared_with_the_first_or_with_a_baseline(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = bl.sweep(PLAN, out=tmp_path / "food")
    needed = (
        "With 4 runs and 2 tests, the smallest corrected p-value is 0.057. "
        "At least 5 runs are needed. To add runs, set runs = 5 in the file of the sweep"
    )
    # The message is printed before the runs.
    assert needed in capsys.readouterr().out.split("of 8 runs")[0]
    page = study.report().read_text("utf-8")
    assert "Each condition is compared with world.food.0.count = 50." in page and needed in page
    assert page.index("Comparison of the points") < page.index("Response to each field")
    rows, expected = pd.read_csv(study.directory / "statistics.csv"), study.compare()
    pd.testing.assert_frame_equal(rows, expected[rows.columns], check_dtype=False)
    turned = study.compare("point-0001")
    assert set(turned["condition_a"]) == {"world.food.0.count = 50"}
    assert (turned["effect"] == -expected["effect"]).all()


def test_samples_and_many_points_are_not_compared() -> None:
    few = validate_sweep(PLAN, "it")
    drawn = validate_sweep(PLAN | {"design": "random", "samples": 5}, "it")
    assert are_compared(few, 100) and not are_compared(few, 101)
    assert not are_compared(drawn, 5) and describe_too_few_runs(drawn, 5) == ""
