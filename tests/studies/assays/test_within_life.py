"""The assay `within-life`, compared with the traces of the same lifetimes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from baldwinlab.evolution import GenerationKey
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.simulation.replay import replay
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.store import StudyStore
from tests.evolution.single_runs import draw_genomes
from tests.studies.assays.studies import make_small_study_with_assays
from tests.worlds import make_small_experiment


def first_meals(trace: xr.Dataset) -> Any:
    ate = trace.eaten > 0
    return ate.argmax("step").where(ate.any("step"))


def test_first_meals_and_windows_equal_the_trace(tmp_path: Path) -> None:
    scarce_food = {"food": [{"x": [20, 30], "y": [10, 90], "count": 1}]}
    experiment = make_small_experiment(
        "evo+self-taught", world=scarce_food, lifetime={"steps": 600}, learning={"rate": 0.5}
    )
    study = make_small_study_with_assays(tmp_path, [experiment], ["within-life"])
    assay = open_assay(tmp_path, "within-life", "evo+self-taught/A")
    assert assay.newborns.values.tolist() == [
        "random genome",
        "generation 0",
        "generation 1",
        "generation 2",
    ]
    assert assay.window.values.tolist() == [0, 250, 500]
    for generation in range(3):
        of_generation = assay.sel(run=2, newborns=f"generation {generation}")
        trace = replay(experiment, seed=study.seed, run=2, generation=generation)
        assert np.array_equal(of_generation.first_meal, first_meals(trace), equal_nan=True)
        for first in (0, 250, 500):
            assert np.array_equal(
                of_generation.eaten_in_window.sel(window=first),
                trace.eaten[first : first + 250].sum("step"),
            )
    assert assay.first_meal.isnull().any()
    assert assay.eaten_in_window.sel(window=500).sum() > 0


def test_the_sum_of_the_windows_equals_the_food_eaten_in_a_lifetime(study: StudyStore) -> None:
    for condition in study.experiments:
        assay = open_assay(study.directory, "within-life", condition)
        for generation in range(3):
            newborns = assay.sel(newborns=f"generation {generation}")
            eaten = newborns.eaten_in_window.sum("window")
            stored = [study.read(condition, run).food_eaten[generation] for run in range(3)]
            assert np.array_equal(eaten, stored)
            assert np.array_equal(newborns.first_meal.notnull(), eaten > 0)


def test_agents_with_random_genomes_live_in_the_world_of_the_last_generation(
    study: StudyStore,
) -> None:
    condition = "evo+self-taught/A"
    experiment = study.experiments[condition]
    blank = draw_genomes(experiment, GenerationKey(study.seed, 1, 3))
    for generation in range(3):
        assert not np.isin(blank, study.read(condition, 1).genome[generation]).any()
    eaten = (
        open_assay(study.directory, "within-life", condition)
        .eaten_in_window.sel(run=1, newborns="random genome")
        .sum("window")
    )
    assert np.array_equal(eaten, reevaluate(experiment, study.seed, [1], 2, blank[None]).energy[0])
