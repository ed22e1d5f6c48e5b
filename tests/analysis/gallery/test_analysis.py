"""Systems and times of the gallery, evaluated on artificial assays and runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.estimands import QUESTIONS
from baldwinlab.analysis.gallery.analysis import System, evaluate_systems
from baldwinlab.papers.presets import load
from tests.analysis.assays.artificial_assays import AGENTS, GENERATIONS, RUNS, constant, innate

LEARNER = "evo+self-taught/A"
CONTROL = "evo/A"
STEP = np.arange(GENERATIONS)


def runs(learner: np.ndarray, control: np.ndarray) -> xr.Dataset:
    """Runs in which every agent has the fitness of its generation."""
    energy = np.broadcast_to(
        np.stack([learner, control])[:, None, :, None], (2, RUNS, GENERATIONS, AGENTS)
    )
    coords = {"condition": [LEARNER, CONTROL], "run": np.arange(RUNS), "generation": STEP}
    return xr.Dataset({"energy": (("condition", "run", "generation", "agent"), energy)}, coords)


def evaluate(
    *, off: Any, on: Any, without: Any, study: xr.Dataset | None = None, last: int = 10
) -> System:
    stored = {
        "innate": {LEARNER: innate(LEARNER, off=off, on=on), CONTROL: innate(CONTROL, off=without)}
    }
    dataset = runs(STEP * 1.0, STEP * 1.0) if study is None else study
    (system,) = evaluate_systems(
        dataset, stored, {name: load(name) for name in (LEARNER, CONTROL)}, [LEARNER], last
    )
    return system


def test_a_system_has_one_estimate_per_question_and_its_control() -> None:
    system = evaluate(off=constant(30), on=constant(100), without=constant(50))
    assert tuple(entry.question for entry in system.estimates) == QUESTIONS
    assert system.control == CONTROL


def test_only_requested_conditions_that_learn_are_systems() -> None:
    study = runs(STEP * 1.0, STEP * 1.0)
    for name, requested in ((CONTROL, []), (LEARNER, ["another"])):
        data = (
            innate(name, off=constant(1), on=constant(2))
            if name == LEARNER
            else innate(name, off=constant(1))
        )
        stored = {"innate": {name: data}}
        assert evaluate_systems(study, stored, {name: load(name)}, requested, 10) == []


def test_the_half_way_point_has_generations_and_evaluations() -> None:
    study = runs(learner=np.minimum(STEP * 10.0, 100), control=STEP * 1.0)
    system = evaluate(off=constant(1), on=constant(2), without=constant(1), study=study)
    time = system.time_to_level
    # The level is between the founders' 0 and the best, 100.
    assert time is not None and time.level == pytest.approx(50)
    # The agents of six generations have one lifetime each.
    assert time.generations == 5 and time.evaluations == 6 * AGENTS
    assert math.isnan(time.control_generations), "evolution alone reaches 39"


def test_a_condition_without_a_control_has_no_time_to_level() -> None:
    data = innate(LEARNER, off=constant(1), on=constant(2))
    study = runs(STEP * 1.0, STEP * 1.0).sel(condition=[LEARNER])
    (system,) = evaluate_systems(
        study, {"innate": {LEARNER: data}}, {LEARNER: load(LEARNER)}, [], 10
    )
    assert system.time_to_level is None and system.control == ""
