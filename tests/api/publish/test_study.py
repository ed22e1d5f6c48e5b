"""Reports have sections for stored assays, and reports of sweeps compare their points."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.api.publish.comparisons import are_compared, describe_too_few_runs
from baldwinlab.api.publish.lab_results import compute_results, load_cached_results
from baldwinlab.api.publish.plan import plan_report
from baldwinlab.api.publish.study import publish_study
from baldwinlab.api.study import Study
from baldwinlab.studies.assays.results import encode_assay
from baldwinlab.studies.record_files import RecordFile
from baldwinlab.studies.recorded_arrays import FileContent, open_file
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import validate_sweep
from tests.analysis.assays.artificial_assays import (
    AGENTS,
    GENERATIONS,
    assign_to_study,
    constant,
    innate,
    rising,
)
from tests.small_studies import make_small_study, shorten_preset

A = "evo+self-taught/A"
PLAN = {
    "experiment": "evo/A",
    "runs": 4,
    "set": {"evolution.generations": 2, "lifetime.steps": 60, "world.start.x": 400},
    "fields": {"world.food.0.count": [50, 5]},
}


@pytest.mark.nightly  # two reports with assays
def test_stored_assays_add_a_section_and_nothing_stored_adds_none(tmp_path: Path) -> None:
    experiment = shorten_preset(A).replace(
        population={"size": AGENTS}, evolution={"generations": GENERATIONS}
    )
    study, page = make_small_study(tmp_path / "study", [experiment], 2), tmp_path / "page.html"
    publish_study(plan_report(study, page))
    assert "Baldwin effect?" not in page.read_text("utf-8")
    path = study.directory / "assays" / "innate" / f"{A}.nc"
    path.parent.mkdir(parents=True)
    assay = assign_to_study(innate(A, off=constant(1), on=rising(1, 9)), study, A)
    path.write_bytes(encode_assay(assay))
    publish_study(plan_report(study, page))
    heading = '<h2 id="baldwin">Is there a Baldwin effect?</h2>'
    section = page.read_text("utf-8").partition(heading)[2]
    assert re.search(r"At least \d+ runs are needed\. To add runs: ", section)
    assert '<h2 id="trait-changes">' in page.read_text("utf-8")
    assert (study.directory / "trait-changes.csv").exists()
    assert (study.directory / "baldwin.csv").exists() and (
        study.directory / "baldwin.json"
    ).exists()
    path.write_bytes(path.read_bytes()[:99])
    with pytest.raises(ValueError, match=r"A\.nc is damaged"):
        publish_study(plan_report(study, page))


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
    content = (store.directory / "results.json").read_bytes()
    moved = StudyStore(store.directory.rename(tmp_path / "moved"))
    assert load_cached_results(moved) == compute_results(moved)
    Study(moved).report()
    assert (moved.directory / "results.json").read_bytes() == content


def test_the_results_of_a_study_do_not_name_its_folder(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "named", runs=2)
    Study(study).report()
    assert "named" not in (study.directory / "results.json").read_text()
    cached = load_cached_results(study)
    assert cached is not None
    assert "/named --runs" in cached["comparison"]["too_few"]


def test_the_data_of_a_sweep_can_be_written_as_netcdf(tmp_path: Path) -> None:
    data = bl.sweep(PLAN | {"runs": 1}, out=tmp_path / "food", workers=1).data()
    data.to_netcdf(tmp_path / "sweep.nc")
    with xr.open_dataset(tmp_path / "sweep.nc") as written:
        assert written.attrs["fields"] == data.attrs["fields"] == "world.food.0.count"


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
