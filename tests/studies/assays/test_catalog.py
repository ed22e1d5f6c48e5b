"""The memory and disk estimates of assays are accurate, and excessive requests are refused."""

from __future__ import annotations

import pytest

from baldwinlab.analysis.assays.analysis import evaluate_assays, planned_tests
from baldwinlab.analysis.statistics.significance import PlannedTest
from baldwinlab.api.run_options import RunOptions
from baldwinlab.api.run_study import run_missing_assays
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.resources import NO_NEED
from baldwinlab.papers.presets import load
from baldwinlab.simulation.memory import ENGINE_BYTES
from baldwinlab.studies.assays.catalog import PlannedStudy, estimate_assays, load_assays
from baldwinlab.studies.assays.results import read_assays as open_assays
from baldwinlab.studies.store import StudyStore
from tests.studies.assays.studies import conditions

EXPERIMENTS = {experiment.name: experiment for experiment in conditions()}
ASSAYS = tuple(load_assays())
APPLICABLE = PlannedStudy(EXPERIMENTS, {}).select_applicable(ASSAYS)


def test_the_disk_space_of_assays_is_estimated_within_a_tenth(study: StudyStore) -> None:
    stored = sum(path.stat().st_size for path in (study.directory / "assays").rglob("*.nc"))
    estimated = estimate_assays(study, APPLICABLE, dict.fromkeys(APPLICABLE, 3), workers=2)
    assert estimated.disk == pytest.approx(stored, rel=0.1)
    assert PlannedStudy(study.experiments, study.factors).need(3, 2, ASSAYS) == estimated
    missing = dict.fromkeys(APPLICABLE, ())
    assert estimate_assays(study, missing, dict.fromkeys(APPLICABLE, 3), workers=2) == NO_NEED


def test_the_number_of_statistical_tests_is_planned_before_the_runs(study: StudyStore) -> None:
    """The plan is an upper bound: questions without defined values have no test."""
    planned = planned_tests(study.experiments, APPLICABLE, 3)
    answers = evaluate_assays(open_assays(study))
    tested = sum(
        answer.numbers is not None for result in answers.results for answer in result.answers
    )
    assert tested <= len(planned) <= tested + len(answers.results)
    assert set(planned) == {PlannedTest(3, 3, "sign")}


def test_memory_grows_with_the_number_of_agents_and_workers(study: StudyStore) -> None:
    def memory(agents: int, workers: int) -> int:
        large = load("evo+self-taught/A").replace(population={"size": agents})
        factors = {large.name: study.factors["evo+self-taught/A"]}
        return (
            PlannedStudy({large.name: large}, factors).need(40, workers, ASSAYS).memory
            - ENGINE_BYTES
        )

    assert memory(10_000, 1) > 5 * memory(1000, 1)
    assert memory(1000, 4) > 2 * memory(1000, 1)


def test_insufficient_memory_is_reported_before_the_simulation(
    study: StudyStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("baldwinlab.core.resources.available_memory", lambda: 1000)
    monkeypatch.setattr(
        "baldwinlab.api.run_study.find_missing_assays",
        lambda *arguments: APPLICABLE,
    )
    with pytest.raises(
        RefusedError,
        match=r"\d+ assays: needs about .* of memory, but only 1000\.0 bytes are free",
    ):
        run_missing_assays(study, ASSAYS, RunOptions())
