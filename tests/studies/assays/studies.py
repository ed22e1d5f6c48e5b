"""Small studies with assays."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from baldwinlab.experiment import Experiment
from baldwinlab.studies.assays.catalog import load_assays
from baldwinlab.studies.executors import THREADS, Executor
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study
from tests.studies.completion import complete_assays
from tests.worlds import make_small_experiment

MAP_B = {
    "food": [
        {"x": [10, 50], "y": [50, 80], "count": 5, "energy": 2.5},
        {"x": [60, 90], "y": [20, 40], "count": 4},
    ]
}


def conditions() -> list[Experiment]:
    """Return the conditions of the paper on a small map A, and a learner on a map B.

    The food of map B has two different energies.
    """
    # A high learning rate, because the lifetime is short.
    fast = {"lifetime": {"steps": 120}, "learning": {"rate": 0.5}}
    on_map_a = [
        make_small_experiment(condition).replace(**fast)
        for condition in ("evo", "evo+self-taught", "self-taught")
    ]
    return [*on_map_a, on_map_a[1].replace(name="evo+self-taught/B", world=MAP_B)]


def make_small_study_with_assays(
    directory: Path,
    experiments: list[Experiment] | None = None,
    names: Sequence[str] = tuple(load_assays()),
    runs: int = 3,
    workers: int = 2,
    executor: Executor = THREADS,
) -> StudyStore:
    """Create a study and run assays with an executor."""
    study = make_small_study(directory, experiments or conditions(), runs)
    complete_assays(study, names, workers, executor=executor)
    return study
