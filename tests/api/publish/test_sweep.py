"""The report of a sweep."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.api.publish.lab_results import compute_results
from baldwinlab.api.publish.results_cache import load_cached_results
from baldwinlab.studies.store import StudyStore

PLAN = {
    "experiment": "evo/A",
    "runs": 1,
    "set": {"lifetime": {"steps": 60}, "evolution.generations": 2},
    "fields": {"world.food.0.count": [0, 50]},
}


def test_a_report_reads_each_run_once_and_stores_the_results_of_all_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep = bl.sweep(PLAN, out=tmp_path / "food", workers=1)
    reads = Counter[tuple[str, int]]()
    read = StudyStore.read

    def count_read(store: StudyStore, condition: str, run: int, **options: Any) -> xr.Dataset:
        reads[condition, run] += 1
        return read(store, condition, run, **options)

    monkeypatch.setattr(StudyStore, "read", count_read)
    sweep.report()
    assert reads == {("point-0000", 0): 1, ("point-0001", 0): 1}
    store = StudyStore(sweep.directory)
    assert load_cached_results(store) == compute_results(store)
