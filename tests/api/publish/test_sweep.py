"""The report of a sweep."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest

import baldwinlab as bl
from baldwinlab.api.publish.lab_results import compute_results
from baldwinlab.api.publish.results_cache import load_cached_results
from baldwinlab.studies.file_content import FileContent, open_file
from baldwinlab.studies.record_files import RecordFile
from baldwinlab.studies.store import StudyStore

PLAN = {
    "experiment": "evo/A",
    "runs": 1,
    "set": {"lifetime": {"steps": 60}, "evolution.generations": 2},
    "fields": {"world.food.0.count": [0, 50]},
}


def test_a_report_verifies_each_file_once_and_stores_the_results_of_all_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep = bl.sweep(PLAN, out=tmp_path / "food", workers=1)
    verified = Counter[str]()

    def count_file(file: RecordFile, *arguments: Any) -> FileContent:
        verified[file.path.parent.name] += 1
        return open_file(file, *arguments)

    monkeypatch.setattr("baldwinlab.studies.lazy_runs.open_file", count_file)
    sweep.report()
    assert verified == {"point-0000": 1, "point-0001": 1}
    store = StudyStore(sweep.directory)
    assert load_cached_results(store) == compute_results(store)
