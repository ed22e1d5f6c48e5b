"""What assays are estimated to take is what they take; what is too large is refused before a file is made."""

from __future__ import annotations

import pytest

from baldwinlab.analysis.assays.analysis import evaluate_assays, planned_designs
from baldwinlab.analysis.statistics.sample_sizes import Design
from baldwinlab.api.run_study import RunOptions, run_missing_assays
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.resources import NOTHING
from baldwinlab.papers.presets import load
from baldwinlab.simulation.memory import ENGINE
from baldwinlab.studies.assays.catalog import ASSAYS, why_not_applicable
from baldwinlab.studies.assays.memory import PlannedStudy, estimate_assays
from baldwinlab.studies.assays.storage import read_assays as open_assays
from baldwinlab.studies.store import StudyStore
from tests.studies.assays.studies import conditions

FITTING = {
    experiment.name: [name for name in ASSAYS if not why_not_applicable(name, experiment)]
    for experiment in conditions()
}


def test_the_disk_that_assays_take_is_estimated_within_a_tenth(study: StudyStore) -> None:
    stored = sum(path.stat().st_size for path in (study.directory / "assays").rglob("*.nc"))
    estimated = estimate_assays(study, FITTING, dict.fromkeys(FITTING, 3), workers=2)
    assert estimated.disk == pytest.approx(stored, rel=0.1)
    assert PlannedStudy(study.experiments, study.factors).need(3, workers=2) == estimated


def test_the_tests_of_the_questions_are_counted_before_the_runs(study: StudyStore) -> None:
    """At most: a question whose quantities are undefined in every run is not tested."""
    fitting = PlannedStudy(study.experiments, study.factors).select_applicable(tuple(ASSAYS))
    planned = planned_designs(study.experiments, fitting, 3)
    found = evaluate_assays(open_assays(study))
    tested = sum(
        answer.numbers is not None for result in found.results for answer in result.answers
    )
    assert tested <= len(planned) <= tested + len(found.results)
    assert set(planned) == {Design(3, 3, "Wilcoxon")}


def test_nothing_is_needed_where_nothing_is_missing(study: StudyStore) -> None:
    assert (
        estimate_assays(study, dict.fromkeys(FITTING, ()), dict.fromkeys(FITTING, 3), workers=2)
        == NOTHING
    )


def test_memory_grows_with_the_agents_and_with_the_workers(study: StudyStore) -> None:
    def memory(agents: int, workers: int) -> int:
        large = load("evo+self-taught/A").replace(population={"size": agents})
        return (
            PlannedStudy({large.name: large}, {large.name: study.factors["evo+self-taught/A"]})
            .need(40, workers)
            .memory
            - ENGINE
        )

    assert memory(10_000, 1) > 5 * memory(1000, 1)
    assert memory(1000, 4) > 2 * memory(1000, 1)


def test_too_little_memory_is_told_before_anything_is_lived_again(
    study: StudyStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("baldwinlab.core.resources.available_memory", lambda: 1000)
    monkeypatch.setattr(
        "baldwinlab.api.run_study.find_missing_assays", lambda study, names: FITTING
    )
    with pytest.raises(
        RefusedError,
        match=r"\d+ assays: needs about .* of memory, but only 1000\.0 bytes are free",
    ):
        run_missing_assays(study, list(ASSAYS), RunOptions())
