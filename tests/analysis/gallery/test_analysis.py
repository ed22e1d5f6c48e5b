"""Sizes and clocks of the gallery, of assays and runs whose answers are known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.gallery.analysis import System, evaluate_systems
from baldwinlab.papers.presets import load
from tests.analysis.assays.assayed import AGENTS, GENERATIONS, RUNS, constant, innate, rising

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


def asked(
    *, off: Any, on: Any, without: Any, study: xr.Dataset | None = None, last: int = 10
) -> System:
    stored = {
        "innate": {LEARNER: innate(LEARNER, off=off, on=on), CONTROL: innate(CONTROL, off=without)}
    }
    lived = runs(STEP * 1.0, STEP * 1.0) if study is None else study
    (found,) = evaluate_systems(
        lived, stored, {name: load(name) for name in (LEARNER, CONTROL)}, [LEARNER], last
    )
    return found


def size(found: System, criterion: str) -> float:
    answer = found.answers[criterion]
    assert answer.size is not None
    return answer.size.median


def test_sizes_are_shares_of_the_fitness_as_lived_at_last() -> None:
    found = asked(off=constant(30), on=constant(100), without=constant(50))
    assert size(found, "gain") == pytest.approx(0.7), "70 of 100 are owed to learning"
    assert size(found, "innate") == pytest.approx(0)
    assert size(found, "guidance") == pytest.approx(-0.2), (
        "30 are innate where evolution alone makes 50"
    )
    assert found.answers["guidance"].verdict == "no" and found.control == CONTROL
    assert found.answers["cost"].size is None, "as no life was frozen"


def test_what_is_taken_over_rises_as_much_as_the_gain_falls() -> None:
    found = asked(off=rising(0, 100), on=constant(100), without=constant(100))
    assert (
        size(found, "innate") == pytest.approx(-size(found, "need")) and size(found, "innate") > 0.7
    )
    assert found.phases[1] == "yes"


def test_selection_sees_what_is_innate_unless_learning_makes_all_alike_or_turns_it_round() -> None:
    stored = innate(LEARNER, off=constant(10), on=constant(10))
    order = np.arange(AGENTS, dtype=float)
    correlations = {}
    for name, lived in (("as born", order), ("turned round", -order), ("alike", 0 * order)):
        data = stored.copy(deep=True)
        data["energy"].loc[{"life": "off"}] = order
        data["energy"].loc[{"life": "on"}] = lived
        assays = {"innate": {LEARNER: data}}
        (found,) = evaluate_systems(
            runs(STEP * 1.0, STEP * 1.0), assays, {LEARNER: load(LEARNER)}, [], 10
        )
        correlations[name] = found.correlation and found.correlation.median
    assert correlations == {
        "as born": pytest.approx(1),
        "turned round": pytest.approx(-1),
        "alike": None,
    }


def test_half_way_is_told_on_both_clocks() -> None:
    study = runs(learner=np.minimum(STEP * 10.0, 100), control=STEP * 1.0)
    clock = asked(off=constant(1), on=constant(2), without=constant(1), study=study).clock
    assert clock is not None and clock.level == pytest.approx(50), (
        "between the founders' 0 and the best, 100"
    )
    assert clock.generations == 5 and clock.evaluations == 6 * AGENTS, (
        "the sixth generation, a life each"
    )
    assert math.isnan(clock.generations_without), "evolution alone comes to 39"


def test_a_condition_without_a_rival_has_no_clock_and_no_guidance() -> None:
    data = innate(LEARNER, off=constant(1), on=constant(2))
    study = runs(STEP * 1.0, STEP * 1.0).sel(condition=[LEARNER])
    (found,) = evaluate_systems(
        study, {"innate": {LEARNER: data}}, {LEARNER: load(LEARNER)}, [], 10
    )
    assert found.clock is None and found.answers["guidance"] == ("not measured", None)


def test_only_the_conditions_that_are_wanted_are_asked() -> None:
    data = innate(LEARNER, off=constant(1), on=constant(2))
    experiments = {LEARNER: load(LEARNER)}
    assert (
        evaluate_systems(
            runs(STEP * 1.0, STEP * 1.0), {"innate": {LEARNER: data}}, experiments, ["another"], 10
        )
        == []
    )
