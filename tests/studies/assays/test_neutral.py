"""The assay `neutral` compares evolved newborns with newborns of a control without selection."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.studies.assays.catalog import get_assay
from baldwinlab.studies.assays.results import find_missing_assays, open_assay
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.evolution.single_runs import apply_inheritance, draw_genomes, make_generation
from tests.small_studies import make_small_study
from tests.studies.assays.studies import make_small_study_with_assays
from tests.studies.completion import complete_assays
from tests.worlds import make_small_experiment

LEARNER = "evo+self-taught/A"


def neutral_assay(study: StudyStore, condition: str = LEARNER) -> Any:
    return open_assay(study.directory, "neutral", condition).energy


def test_evolved_newborns_have_the_energy_of_the_assay_innate(study: StudyStore) -> None:
    for condition in (LEARNER, "evo+self-taught/B", "evo/A"):
        innate = open_assay(study.directory, "innate", condition).energy.sel(life=["off", "on"])
        evolved = neutral_assay(study, condition).sel(newborns="evolved", drop=True)
        np.testing.assert_array_equal(
            evolved, innate.sel(generation=evolved.generation).transpose(*evolved.dims)
        )


def test_the_control_has_the_same_founders_and_different_children(study: StudyStore) -> None:
    evolved = neutral_assay(study).sel(newborns="evolved")
    control = neutral_assay(study).sel(newborns="neutral control")
    assert np.array_equal(evolved.sel(generation=0), control.sel(generation=0))
    assert not np.array_equal(evolved.sel(generation=2), control.sel(generation=2))


def test_the_control_of_agents_without_learning_has_no_learning(study: StudyStore) -> None:
    energy = neutral_assay(study, "evo/A")
    assert energy.sel(life="on").isnull().all()
    assert energy.sel(life="off").notnull().all()


def test_neutral_selection_does_not_depend_on_fitness() -> None:
    control = make_small_experiment("evo", evolution={"generations": 6}).neutral_control()
    run = bl.simulate(control, seed=3, run=2)
    for generation in range(1, 6):
        before = run.genome.values[generation - 1]
        no_fitness = np.zeros(control.population.size)
        _, parents = make_generation(control, GenerationKey(3, 2, generation), before, no_fitness)
        assert np.array_equal(np.sort(parents), np.sort(run.parents.values[generation]))


def test_the_control_does_not_depend_on_the_selection_scheme(tmp_path: Path) -> None:
    schemes = [
        make_small_experiment("evo", name=name, evolution={"selection": name, "generations": 5})
        for name in ("rank", "truncation")
    ]
    study = make_small_study_with_assays(tmp_path, schemes, ["neutral"])
    rank = neutral_assay(study, "rank")
    truncation = neutral_assay(study, "truncation")
    for newborns, is_equal in (("neutral control", True), ("evolved", False)):
        pair = (rank.sel(newborns=newborns), truncation.sel(newborns=newborns))
        assert np.array_equal(*pair, equal_nan=True) == is_equal


def test_a_population_of_one_agent_equals_its_control(tmp_path: Path) -> None:
    single_agent = make_small_experiment(
        "evo+self-taught",
        population={"size": 1},
        evolution={"generations": 14, "mutation_rate": 1.0},
    )
    energy = neutral_assay(make_small_study_with_assays(tmp_path, [single_agent], ["neutral"]))
    assert energy.generation.values.tolist() == list(range(4, 14))
    assert np.array_equal(energy.sel(newborns="evolved"), energy.sel(newborns="neutral control"))
    assert energy.sum() > 0


def test_the_control_inherits_learned_weights_under_lamarckian_inheritance(tmp_path: Path) -> None:
    experiment = make_small_experiment(
        "evo+self-taught",
        learning={"rate": 0.5},
        evolution={"generations": 12, "lamarckian_share": 1.0},
    )
    study = make_small_study_with_assays(tmp_path, [experiment], ["neutral"], runs=2)
    genome = draw_genomes(experiment, GenerationKey(5, 1, 0))
    control = experiment.neutral_control()
    no_fitness = np.zeros(6)
    for generation in range(11):
        learned_weights = reevaluate(experiment, 5, [1], generation, genome[None]).weights[0]
        inherited = apply_inheritance(experiment, genome, learned_weights)
        key = GenerationKey(5, 1, generation + 1)
        genome, _ = make_generation(control, key, inherited, no_fitness)
    last = neutral_assay(study).sel(run=1, generation=11, newborns="neutral control")
    for life, simulated in (("on", experiment), ("off", experiment.without_learning())):
        expected = reevaluate(simulated, 5, [1], 11, genome[None]).energy[0]
        assert np.array_equal(last.sel(life=life), expected)


@pytest.mark.parametrize(
    ("experiment", "reason"),
    [
        (make_small_experiment("self-taught"), "which needs inherited genomes"),
        (make_small_experiment("evo").neutral_control(), "parents are chosen at random"),
    ],
)
def test_the_assay_does_not_apply_without_selection(
    tmp_path: Path, experiment: Experiment, reason: str
) -> None:
    assert reason in get_assay("neutral").find_obstacle(experiment)
    study = make_small_study(tmp_path, [experiment], runs=1)
    assert find_missing_assays(study, ["neutral"]) == {experiment.name: []}
    complete_assays(study, ["neutral"])
    with pytest.raises(StudyError, match=reason):
        open_assay(tmp_path, "neutral", experiment.name)
    with pytest.raises(StudyError, match=reason):
        bl.open_study(tmp_path).assay("neutral")
