"""Within life, against the traces of the same lives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.simulation.replay import replay
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.store import StudyStore
from tests.studies.assays.studies import measured
from tests.worlds import make_small_experiment


def first_meals(trace: xr.Dataset) -> Any:
    ate = trace.eaten > 0
    return ate.argmax("step").where(ate.any("step"))


def test_meals_and_windows_are_those_of_the_trace(tmp_path: Path) -> None:
    rare = {"food": [{"x": [20, 30], "y": [10, 90], "count": 1}]}
    experiment = make_small_experiment(
        "evo+self-taught", world=rare, lifetime={"steps": 600}, learning={"rate": 0.5}
    )
    study = measured(tmp_path, [experiment], ["within-life"])
    found = open_assay(tmp_path, "within-life", "evo+self-taught/A")
    assert found.newborns.values.tolist() == [
        "random genome",
        "generation 0",
        "generation 1",
        "generation 2",
    ]
    assert found.window.values.tolist() == [0, 250, 500]
    for generation in range(3):
        here = found.sel(run=2, newborns=f"generation {generation}")
        trace = replay(experiment, seed=study.seed, run=2, generation=generation)
        assert np.array_equal(here.first_meal, first_meals(trace), equal_nan=True)
        for first in (0, 250, 500):
            assert np.array_equal(
                here.eaten_in_window.sel(window=first), trace.eaten[first : first + 250].sum("step")
            )
    assert found.first_meal.isnull().any()
    assert found.eaten_in_window.sel(window=500).sum() > 0


def test_windows_sum_to_what_is_eaten_in_life(study: StudyStore) -> None:
    for condition in study.experiments:
        found = open_assay(study.directory, "within-life", condition)
        for generation in range(3):
            whole = found.eaten_in_window.sel(newborns=f"generation {generation}").sum("window")
            stored = [study.read(condition, run).food_eaten[generation] for run in range(3)]
            assert np.array_equal(whole, stored)
            assert np.array_equal(
                found.first_meal.sel(newborns=f"generation {generation}").notnull(), whole > 0
            )


def test_blank_slates_are_drawn_afresh_and_born_where_the_last_generation_was(
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
