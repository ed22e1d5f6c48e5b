"""One estimate for every question, with its class and the reason for it."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.analysis.estimands import (
    IMPOSSIBLE,
    MEASURED,
    NOT_MEASURABLE,
    QUESTIONS,
    Estimate,
    estimate,
)
from baldwinlab.studies.assays.fork import HISTORIES, REGIMES
from tests.analysis.estimands.conftest import Stored


def estimates(data: Stored, **assays: xr.Dataset) -> dict[str, Estimate]:
    rows = estimate(data.runs, assays, data.experiment, 5)
    assert tuple(row.question for row in rows) == QUESTIONS
    return {row.question: row for row in rows}


def fork() -> xr.Dataset:
    """A fork in which history adds 3 and learning removes 1, and 2 more from the control.

    Both effects are absent in the first of two start generations.
    """
    shape = (4, 2, len(HISTORIES), len(REGIMES), 6)
    fitness = np.full(shape, 10.0)
    fitness[:, 1, HISTORIES.index("learner")] += 3
    fitness[:, 1, :, REGIMES.index("on")] -= 1
    fitness[:, 1, HISTORIES.index("control"), REGIMES.index("on")] -= 2
    dims = ("run", "generation", "history", "regime", "agent")
    coords = {
        "run": np.arange(4),
        "generation": [0, 11],
        "history": list(HISTORIES),
        "regime": list(REGIMES),
    }
    return xr.Dataset({"innate_fitness": (dims, fitness), "fitness": (dims, fitness)}, coords)


def test_every_question_has_a_row_although_no_assay_is_stored(stored: dict[str, Stored]) -> None:
    rows = estimates(stored["costly-climbing/rugged"])
    for row in rows.values():
        assert (row.measurability, row.values) == (NOT_MEASURABLE, None)
        assert row.reason.endswith(".")
    assert rows["fork-history"].reason == "The assay fork is not stored."


def test_a_measured_question_has_one_value_per_run_and_a_bound(stored: dict[str, Stored]) -> None:
    data = stored["guessing"]
    rows = estimates(data, innate=data.innate)
    for name in ("selection-by-learning", "assimilation", "savings"):
        row = rows[name]
        assert row.measurability == MEASURED
        assert row.values is not None
        assert row.values.dims == ("run",)
        assert set(row.values.coords) == {"run"}
        assert row.equivalence_bound > 0
        assert row.trait


def test_effects_of_a_fork_are_those_of_the_last_start(stored: dict[str, Stored]) -> None:
    rows = estimates(stored["costly-climbing/rugged"], fork=fork())
    # The history is decided without learning, the regime on the mean of both histories.
    for name, effect in {"fork-history": 3, "fork-regime": -2}.items():
        values = rows[name].values
        assert values is not None
        # Without learning, the genomes of learners have an innate fitness of 13.
        assert values.values.tolist() == pytest.approx([effect / 13] * 4)
        assert rows[name].equivalence_bound == 0.02
    # An effect of history is a share of the better genomes.
    worse = fork()
    worse["innate_fitness"].loc[{"history": "learner"}] = 2.5
    values = estimates(stored["costly-climbing/rugged"], fork=worse)["fork-history"].values
    assert values is not None
    assert values.values.tolist() == pytest.approx([-0.75] * 4)
    # A fork with constant innate fitness is not measurable.
    constant = fork().map(np.ones_like, keep_attrs=True)
    rows = estimates(stored["costly-climbing/rugged"], fork=constant)
    for name in ("fork-history", "fork-regime"):
        assert rows[name].measurability == NOT_MEASURABLE
        assert rows[name].reason == "Innate fitness is 1 for all agents of all branches."


def test_a_learned_step_of_constant_length_cannot_become_innate(
    stored: dict[str, Stored],
) -> None:
    data = stored["stepping/convex"]
    row = estimates(data, innate=data.innate)["assimilation"]
    assert row.measurability == IMPOSSIBLE
    assert row.reason == "Learning adds the same step to x in every life."


def test_questions_without_an_answer_are_not_measurable_or_impossible(
    stored: dict[str, Stored],
) -> None:
    data = stored["guessing"]
    experiment = data.experiment.replace(evolution={"inheritance": "none"})
    rows = estimate(data.runs, {"innate": data.innate}, experiment, 5)
    assert {(row.measurability, row.reason) for row in rows} == {
        (IMPOSSIBLE, "Genomes are not inherited.")
    }
    # Questions on several species are not measurable.
    species = bl.load("invasion:learner-on-needle")
    rows = estimate(data.runs, {"innate": data.innate}, species, 5)
    assert {row.measurability for row in rows} == {NOT_MEASURABLE}
    # A distance that is 0 from the start is not measurable.
    without_unset = data._replace(runs=data.runs.assign(unset=data.runs["unset"] * 0))
    row = estimates(without_unset, innate=data.innate)["assimilation"]
    assert (row.measurability, row.values) == (NOT_MEASURABLE, None)
    # An unknown selection scheme is not measurable.
    experiment = data.experiment.replace(evolution={"selection": "lexicase"})
    row = estimates(data._replace(experiment=experiment), innate=data.innate)[
        "selection-by-learning"
    ]
    assert row.measurability == NOT_MEASURABLE
    assert "lexicase" in row.reason
