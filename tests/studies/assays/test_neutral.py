"""The neutral twin: bred by chance alone, and compared with those that were selected in the same world."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey, apply_inheritance, draw_genomes, make_generation
from baldwinlab.experiment import Experiment
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.studies.assays.catalog import why_not_applicable
from baldwinlab.studies.assays.results import find_missing_assays, open_assay
from baldwinlab.studies.assays.run import run_assays
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.small_studies import ignore_message, ignore_progress, make_small_study
from tests.studies.assays.studies import measured
from tests.worlds import make_small_experiment

LEARNER = "evo+self-taught/A"


def neutral(study: StudyStore, condition: str = LEARNER) -> Any:
    return open_assay(study.directory, "neutral", condition).energy


def test_those_that_evolved_are_the_ones_of_the_study_and_of_the_assay_of_what_is_innate(
    study: StudyStore,
) -> None:
    for condition in (LEARNER, "evo+self-taught/B", "evo/A"):
        innate = open_assay(study.directory, "innate", condition).energy.sel(life=["off", "on"])
        own = neutral(study, condition).sel(newborns="evolved", drop=True)
        np.testing.assert_array_equal(
            own, innate.sel(generation=own.generation).transpose(*own.dims)
        )


def test_founders_are_their_own_twins_and_their_children_are_not(study: StudyStore) -> None:
    own, twin = (neutral(study).sel(newborns=name) for name in ("evolved", "neutral control"))
    assert np.array_equal(own.sel(generation=0), twin.sel(generation=0))
    assert not np.array_equal(own.sel(generation=2), twin.sel(generation=2))


def test_agents_that_do_not_learn_have_a_twin_that_does_not(study: StudyStore) -> None:
    found = neutral(study, "evo/A")
    assert found.sel(life="on").isnull().all() and found.sel(life="off").notnull().all()


def test_the_twin_has_the_parents_of_a_run_with_neutral_selection_whatever_that_gains() -> None:
    twin = make_small_experiment("evo", evolution={"generations": 6}).neutral_control()
    run = bl.simulate(twin, seed=3, run=2)
    for generation in range(1, 6):
        before, nothing = run.genome.values[generation - 1], np.zeros(twin.population.size)
        _, parents = make_generation(twin, GenerationKey(3, 2, generation), before, nothing)
        assert np.array_equal(np.sort(parents), np.sort(run.parents.values[generation]))


def test_however_parents_were_selected_the_twin_is_the_same(tmp_path: Path) -> None:
    schemes = [
        make_small_experiment("evo", name=name, evolution={"selection": name, "generations": 5})
        for name in ("rank", "truncation")
    ]
    study = measured(tmp_path, schemes, ["neutral"])
    one, other = (neutral(study, name) for name in ("rank", "truncation"))
    assert np.array_equal(
        one.sel(newborns="neutral control"), other.sel(newborns="neutral control"), equal_nan=True
    )
    assert not np.array_equal(
        one.sel(newborns="evolved"), other.sel(newborns="evolved"), equal_nan=True
    )


def test_one_agent_alone_is_its_own_twin_generation_by_generation(tmp_path: Path) -> None:
    alone = make_small_experiment(
        "evo+self-taught",
        population={"size": 1},
        evolution={"generations": 14, "mutation_rate": 1.0},
    )
    found = neutral(measured(tmp_path, [alone], ["neutral"]))
    assert found.generation.values.tolist() == list(range(4, 14))
    assert np.array_equal(found.sel(newborns="evolved"), found.sel(newborns="neutral control"))
    assert found.sum() > 0


def test_where_what_is_learned_is_inherited_the_twin_lives_for_it(tmp_path: Path) -> None:
    experiment = make_small_experiment(
        "evo+self-taught",
        learning={"rate": 0.5},
        evolution={"generations": 12, "lamarckian_share": 1.0},
    )
    study = measured(tmp_path, [experiment], ["neutral"], runs=2)
    genome, twin, nothing = (
        draw_genomes(experiment, GenerationKey(5, 1, 0)),
        experiment.neutral_control(),
        np.zeros(6),
    )
    for generation in range(11):
        died = reevaluate(experiment, 5, [1], generation, genome[None]).weights[0]
        genome, _ = make_generation(
            twin,
            GenerationKey(5, 1, generation + 1),
            apply_inheritance(experiment, genome, died),
            nothing,
        )
    last = neutral(study).sel(run=1, generation=11, newborns="neutral control")
    for life, lived in (("on", experiment), ("off", experiment.without_learning())):
        assert np.array_equal(
            last.sel(life=life), reevaluate(lived, 5, [1], 11, genome[None]).energy[0]
        )


@pytest.mark.parametrize(
    "changes", [{}, {"evolution": {"generations": 12, "lamarckian_share": 0.5}}]
)
def test_as_much_is_lived_as_was_said(tmp_path: Path, changes: dict[str, object]) -> None:
    study = make_small_study(
        tmp_path, [make_small_experiment("evo+self-taught", **changes)], runs=2
    )
    amounts: list[int] = []

    @contextmanager
    def noted(description: str, total: int) -> Iterator[Callable[[int], None]]:
        amounts.append(-total)
        yield amounts.append

    run_assays(study, find_missing_assays(study, ["neutral"]), 1, noted, ignore_message)
    assert amounts[0] < 0 == sum(amounts)


@pytest.mark.parametrize(
    ("experiment", "why"),
    [
        (make_small_experiment("self-taught"), "which needs inherited genomes"),
        (make_small_experiment("evo").neutral_control(), "parents are chosen at random"),
    ],
)
def test_where_selection_builds_nothing_there_is_no_such_assay(
    tmp_path: Path, experiment: Experiment, why: str
) -> None:
    assert why in why_not_applicable("neutral", experiment)
    study = make_small_study(tmp_path, [experiment], runs=1)
    assert find_missing_assays(study, ["neutral"]) == {experiment.name: []}
    run_assays(study, find_missing_assays(study, ["neutral"]), 1, ignore_progress, ignore_message)
    with pytest.raises(StudyError, match=why):
        open_assay(tmp_path, "neutral", experiment.name)
    with pytest.raises(StudyError, match=why):
        bl.open_study(tmp_path).assay("neutral")
