"""Effect sizes and times of the gallery, evaluated on artificial assays and runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.gallery.analysis import System, evaluate_systems
from baldwinlab.papers.presets import load
from tests.analysis.assays.artificial_assays import (
    AGENTS,
    GENERATIONS,
    RUNS,
    constant,
    innate,
    rising,
)

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


def size(system: System, criterion: str) -> float:
    answer = system.effects[criterion]
    assert answer.size is not None
    return answer.size.median


def test_sizes_are_shares_of_the_last_fitness_with_learning() -> None:
    system = evaluate(off=constant(30), on=constant(100), without=constant(50))
    assert size(system, "gain") == pytest.approx(0.7), "learning adds 70 of 100"
    assert size(system, "innate") == pytest.approx(0)
    assert size(system, "guidance") == pytest.approx(-0.2), (
        "30 are innate, and evolution alone reaches 50"
    )
    assert system.effects["guidance"].verdict == "no" and system.control == CONTROL
    assert system.effects["cost"].size is None, "no lifetime had frozen weights"


def test_innate_fitness_rises_as_much_as_the_gain_falls() -> None:
    system = evaluate(off=rising(0, 100), on=constant(100), without=constant(100))
    assert (
        size(system, "innate") == pytest.approx(-size(system, "need"))
        and size(system, "innate") > 0.7
    )
    assert system.phases[1] == "yes"


def test_innate_and_learned_fitness_correlate_unless_learning_equalizes_or_reverses_ranks() -> None:
    stored = innate(LEARNER, off=constant(10), on=constant(10))
    order = np.arange(AGENTS, dtype=float)
    correlations = {}
    for name, learned in (("same order", order), ("reversed", -order), ("equal", 0 * order)):
        data = stored.copy(deep=True)
        data["energy"].loc[{"life": "off"}] = order
        data["energy"].loc[{"life": "on"}] = learned
        assays = {"innate": {LEARNER: data}}
        (system,) = evaluate_systems(
            runs(STEP * 1.0, STEP * 1.0), assays, {LEARNER: load(LEARNER)}, [], 10
        )
        correlations[name] = system.correlation and system.correlation.median
    assert correlations == {
        "same order": pytest.approx(1),
        "reversed": pytest.approx(-1),
        "equal": None,
    }


def test_the_half_way_point_has_generations_and_evaluations() -> None:
    study = runs(learner=np.minimum(STEP * 10.0, 100), control=STEP * 1.0)
    system = evaluate(off=constant(1), on=constant(2), without=constant(1), study=study)
    time = system.time_to_level
    assert time is not None and time.level == pytest.approx(50), (
        "between the founders' 0 and the best, 100"
    )
    assert time.generations == 5 and time.evaluations == 6 * AGENTS, (
        "six generations with one lifetime per agent"
    )
    assert math.isnan(time.control_generations), "evolution alone reaches 39"


def test_a_condition_without_a_control_has_no_time_to_level_and_no_guidance() -> None:
    data = innate(LEARNER, off=constant(1), on=constant(2))
    study = runs(STEP * 1.0, STEP * 1.0).sel(condition=[LEARNER])
    (system,) = evaluate_systems(
        study, {"innate": {LEARNER: data}}, {LEARNER: load(LEARNER)}, [], 10
    )
    assert system.time_to_level is None and system.effects["guidance"] == ("not measured", None)


def test_only_requested_conditions_are_evaluated() -> None:
    data = innate(LEARNER, off=constant(1), on=constant(2))
    experiments = {LEARNER: load(LEARNER)}
    assert (
        evaluate_systems(
            runs(STEP * 1.0, STEP * 1.0), {"innate": {LEARNER: data}}, experiments, ["another"], 10
        )
        == []
    )
