"""The assay `reaction-norms` measures fitness by the amount of learning in four generations."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.studies.assays.catalog import get_assay
from baldwinlab.studies.assays.reaction_norms import (
    LEARNING_FACTORS,
    assayed_generations,
    scale_learning,
)
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.store import StudyStore
from tests.worlds import make_small_experiment

LEARNER = "evo+self-taught/A"


def test_a_factor_multiplies_the_learning_rate(study: StudyStore) -> None:
    energy = open_assay(study.directory, "reaction-norms", LEARNER).energy
    experiment = study.experiments[LEARNER]
    for generation in (0, 2):
        stored = [study.read(LEARNER, run).genome.values[generation] for run in range(3)]
        for factor in (0.25, 2.0):
            changed = experiment.replace(learning={"rate": 0.5 * factor})
            repeated = reevaluate(changed, study.seed, range(3), generation, np.stack(stored))
            assayed = energy.sel(generation=generation, factor=factor)
            assert np.array_equal(assayed, repeated.energy)
    # The factors 0 and 1 are innate and learned fitness.
    innate = open_assay(study.directory, "innate", LEARNER).energy
    assert energy.factor.values.tolist() == list(LEARNING_FACTORS)
    for factor, life in ((0, "off"), (1, "on")):
        assert np.array_equal(energy.sel(factor=factor), innate.sel(life=life))


@pytest.mark.parametrize(
    ("n_generations", "expected"),
    [(1, [0]), (2, [0, 1]), (3, [0, 1, 2]), (31, [0, 10, 20, 30]), (100, [0, 33, 66, 99])],
)
def test_four_generations_have_equal_distances(n_generations: int, expected: list[int]) -> None:
    experiment = make_small_experiment("evo").replace(evolution={"generations": n_generations})
    assert assayed_generations(experiment) == expected


def test_the_settings_are_those_of_the_generation_in_a_schedule() -> None:
    changes = [{"generation": 2, "learning": {"rate": 0.4}}]
    experiment = make_small_experiment("evo+self-taught", learning={"rate": 0.1}, schedule=changes)
    rates = [scale_learning(experiment, generation, 2.0) for generation in (0, 2)]
    assert [rate.learning.rate for rate in rates if rate] == [0.2, 0.8]


@pytest.mark.parametrize(
    ("condition", "factor", "setting", "expected"),
    [
        ("hinton-nowlan-1987:guessing", 0.25, "trials", 250),
        ("mayley-1996:climbing/smooth", 0.25, "trials", 8),
        ("paenke-2007:stepping/convex", 4.0, "learning_step", 1.2),
    ],
)
def test_models_declare_what_a_factor_multiplies(
    condition: str, factor: float, setting: str, expected: float
) -> None:
    changed = scale_learning(bl.load(condition), 0, factor)
    assert changed is not None
    assert getattr(changed.model_part, setting) == pytest.approx(expected)


def test_a_number_of_trials_that_rounds_to_0_is_learning_off() -> None:
    experiment = bl.load("mayley-1996:climbing/smooth").replace(nk_climbers={"trials": 1})
    assert scale_learning(experiment, 0, 0.25) == experiment.without_learning()


def test_an_invalid_amount_of_learning_has_no_fitness(tmp_path: Path) -> None:
    condition = bl.load("todd-miller-1991:hebbian/smell-55").replace(
        population={"size": 10}, evolution={"generations": 2}, cue_learners={"learning_rate": 1.5}
    )
    study = bl.run([condition], runs=1, seed=1, out=tmp_path / "study", workers=1)
    energy = study.assay("reaction-norms", condition.name, workers=1).energy
    is_defined = energy.notnull().all(("run", "generation", "agent"))
    # A rate above 2 is not valid.
    assert is_defined.values.tolist() == [True, True, True, True, False, False]


@pytest.mark.parametrize(
    ("condition", "reason"),
    [
        ("evo/A", "needs a condition that learns"),
        ("soltoggio-2008:modulated-plasticity/single", "the model t-mazes of .* declares none"),
    ],
)
def test_conditions_without_an_amount_of_learning_are_refused(condition: str, reason: str) -> None:
    experiment = bl.load(condition)
    assert re.search(reason, get_assay("reaction-norms").find_obstacle(experiment))
